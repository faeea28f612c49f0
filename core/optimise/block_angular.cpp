#include "core/optimise/block_angular.hpp"

namespace wheelhop {

BlockAngular::BlockAngular(Index common, Index own, Index groups, const std::vector<RowBlock>& blocks)
    : common_(common), own_(own), groups_(groups) {
  for (const RowBlock& block : blocks) {
    if (block.count == 0) continue;
    if (!blocks_.empty() && blocks_.back().group == block.group)
      blocks_.back().count += block.count;
    else
      blocks_.push_back(block);
  }
}

Vector BlockAngular::of_group(ConstVectorRef x, Index group) const {
  Vector values(stored());
  values << x.head(common_), x.segment(common_ + own_ * group, own_);
  return values;
}

void BlockAngular::add_of_group(const Matrix& part, Index group, Matrix& whole) const {
  for (Index j = 0; j < part.cols(); ++j)
    for (Index i = 0; i < part.rows(); ++i) whole(column(i, group), column(j, group)) += part(i, j);
}

Matrix BlockAngular::gram(ConstMatrixRef J) const {
  Matrix whole = Matrix::Zero(columns(), columns());
  for (const RowBlock& block : blocks_) {
    const auto rows = J.middleRows(block.first, block.count);
    add_of_group(rows.transpose() * rows, block.group, whole);
  }
  return whole;
}

Matrix BlockAngular::lower_gram(ConstMatrixRef J) const {
  Matrix whole = Matrix::Zero(columns(), columns());
  for (const RowBlock& block : blocks_) {
    Matrix part = Matrix::Zero(stored(), stored());
    part.selfadjointView<Eigen::Lower>().rankUpdate(J.middleRows(block.first, block.count).transpose());
    add_of_group(part, block.group, whole);
  }
  return whole;
}

Vector BlockAngular::transposed_times(ConstMatrixRef J, ConstVectorRef r) const {
  Vector whole = Vector::Zero(columns());
  for (const RowBlock& block : blocks_) {
    const Vector part = J.middleRows(block.first, block.count).transpose() * r.segment(block.first, block.count);
    whole.head(common_) += part.head(common_);
    whole.segment(common_ + own_ * block.group, own_) += part.tail(own_);
  }
  return whole;
}

void BlockAngular::subtract_times(ConstMatrixRef J, ConstVectorRef s, VectorRef r) const {
  for (const RowBlock& block : blocks_)
    r.segment(block.first, block.count).noalias() -= J.middleRows(block.first, block.count) * of_group(s, block.group);
}

}  // namespace wheelhop
