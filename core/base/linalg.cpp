#include "core/base/linalg.hpp"

#include <Eigen/Dense>
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

}  // namespace wheelhop
