/// \file
/// Matrices whose rows fall into groups and whose columns belong to all groups or to one: the Jacobian of several
/// records that share their parameters and have an initial state each. Only columns that a row can have are stored, so
/// that memory grows with the rows and not with rows times groups. Block-angular form: Bjorck 1996, Numerical Methods
/// for Least Squares Problems, sec. 6.3.
#pragma once

#include <vector>

#include "core/base/linalg.hpp"

namespace wheelhop {

/// Rows that follow one another and belong to one group.
struct RowBlock {
  Index first = 0, count = 0, group = 0;
};

/// Where the numbers of such a matrix A (rows x columns()) stand in its stored form J (rows x stored()): the columns of
/// all groups first, then those of the row's own group. A dense matrix is one group without columns of its own.
class BlockAngular {
 public:
  BlockAngular() = default;
  /// @param common columns of all groups   @param own columns of each group   @param blocks in the order of the rows
  BlockAngular(Index common, Index own, Index groups, const std::vector<RowBlock>& blocks);

  Index common() const { return common_; }
  Index own() const { return own_; }
  Index groups() const { return groups_; }
  Index columns() const { return common_ + own_ * groups_; }
  Index stored() const { return common_ + own_; }
  /// Adjacent ones of a group are one.
  const std::vector<RowBlock>& blocks() const { return blocks_; }

  /// Of a stored column of a group: which column of A it is.
  Index column(Index stored, Index group) const { return stored < common_ ? stored : stored + own_ * group; }
  /// The values of x (columns()) at the stored columns of a group.
  Vector of_group(ConstVectorRef x, Index group) const;

  /// A'A. Cost: O(rows stored()^2).
  Matrix gram(ConstMatrixRef J) const;
  /// A'A, lower triangle, at half the cost.
  Matrix lower_gram(ConstMatrixRef J) const;
  /// A'r
  Vector transposed_times(ConstMatrixRef J, ConstVectorRef r) const;
  /// r -= A s
  void subtract_times(ConstMatrixRef J, ConstVectorRef s, VectorRef r) const;

  /// Adds what the rows of a group make of a matrix columns() x columns() to it. @param part stored() x stored()
  void add_of_group(const Matrix& part, Index group, Matrix& whole) const;

 private:
  Index common_ = 0, own_ = 0, groups_ = 1;
  std::vector<RowBlock> blocks_;
};

}  // namespace wheelhop
