#include "core/base/linalg.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <limits>

namespace wheelhop {

LeastSquares least_squares(ConstMatrixRef A, ConstMatrixRef b, double tolerance) {
  Vector scale = A.colwise().norm().transpose();
  for (double& value : scale) value = value > 0 ? 1 / value : 1;
  const Matrix scaled = A * scale.asDiagonal();
  Eigen::CompleteOrthogonalDecomposition<Matrix> d;
  d.setThreshold(tolerance);
  d.compute(scaled);
  LeastSquares result;
  result.rank = d.rank();
  const Vector pivots = d.matrixQTZ().diagonal().cwiseAbs();
  result.condition = result.rank > 0 ? pivots(0) / pivots(result.rank - 1) : std::numeric_limits<double>::infinity();
  const Matrix y = d.solve(b);
  result.residual_norm = (scaled * y - b).norm();
  result.x = scale.asDiagonal() * y;
  return result;
}

Matrix qr_upper(ConstMatrixRef A) {
  Eigen::HouseholderQR<Matrix> d(A);
  Matrix R = d.matrixQR().topRows(A.cols()).triangularView<Eigen::Upper>();
  for (Index i = 0; i < R.rows(); ++i)
    if (R(i, i) < 0) R.row(i) = -R.row(i);
  return R;
}

Matrix solve(ConstMatrixRef A, ConstMatrixRef B) { return A.partialPivLu().solve(B); }

ComplexMatrix solve_complex(const ComplexMatrix& A, const ComplexMatrix& B) { return A.partialPivLu().solve(B); }

ThinQr thin_qr(const ComplexMatrix& A) {
  const Index n = A.cols();
  const Eigen::HouseholderQR<ComplexMatrix> d(A);
  return {d.householderQ() * ComplexMatrix::Identity(A.rows(), n),
          d.matrixQR().topRows(n).triangularView<Eigen::Upper>()};
}

Matrix cholesky_lower(ConstMatrixRef S) {
  Eigen::LLT<Matrix> d(S);
  return d.info() == Eigen::Success ? Matrix(d.matrixL()) : Matrix();
}

Matrix symmetric_sqrt(ConstMatrixRef S) {
  const SymmetricEigen e = symmetric_eigen(S);
  return e.vectors * e.values.cwiseMax(0.0).cwiseSqrt().asDiagonal() * e.vectors.transpose();
}

Matrix stacked(ConstMatrixRef top, ConstMatrixRef bottom) {
  Matrix both(top.rows() + bottom.rows(), top.cols());
  both << top, bottom;
  return both;
}

Matrix covariance_of(ConstMatrixRef samples) {
  constexpr Index block = 256;  // samples; no copy of a long record is made
  const Vector mean = samples.rowwise().mean();
  Matrix sum = Matrix::Zero(samples.rows(), samples.rows());
  for (Index first = 0; first < samples.cols(); first += block) {
    const Matrix centred = samples.middleCols(first, std::min(block, samples.cols() - first)).colwise() - mean;
    sum.noalias() += centred * centred.transpose();
  }
  return sum / static_cast<double>(samples.cols());
}

}  // namespace wheelhop
