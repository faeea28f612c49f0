#include "core/kernels/streamed_qr.hpp"

#include <Eigen/QR>

namespace wheelhop {

StreamedQr::StreamedQr(Index columns, Index block_rows)
    : buffer_(columns + (block_rows > 0 ? block_rows : 4 * columns), columns), used_(columns) {
  buffer_.topRows(columns).setZero();
}

MatrixRef StreamedQr::next(Index rows) {
  if (used_ + rows > buffer_.rows()) reduce();
  const Index first = used_;
  used_ += rows;
  return buffer_.middleRows(first, rows);
}

void StreamedQr::reduce() {
  const Index columns = buffer_.cols();
  if (used_ == columns) return;
  MatrixRef filled = buffer_.topRows(used_);
  const Eigen::HouseholderQR<MatrixRef> in_place(filled);
  buffer_.topRows(columns).triangularView<Eigen::StrictlyLower>().setZero();
  used_ = columns;
}

Matrix StreamedQr::finish() {
  reduce();
  Matrix R = buffer_.topRows(buffer_.cols());
  for (Index i = 0; i < R.rows(); ++i)
    if (R(i, i) < 0) R.row(i) = -R.row(i);
  return R;
}

LeastSquares solve_from_qr(ConstMatrixRef R, Index unknowns, double tolerance) {
  const Index targets = R.cols() - unknowns;
  LeastSquares result =
      least_squares(R.topLeftCorner(unknowns, unknowns), R.topRightCorner(unknowns, targets), tolerance);
  const double outside = R.bottomRightCorner(targets, targets).norm();
  result.residual_norm = std::hypot(result.residual_norm, outside);
  return result;
}

}  // namespace wheelhop
