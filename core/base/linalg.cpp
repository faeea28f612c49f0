#include "core/base/linalg.hpp"

#include <Eigen/Dense>
#include <limits>
#include <unsupported/Eigen/MatrixFunctions>

namespace wheelhop {

namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

}  // namespace

// Eigen's iterative decompositions leave their results unset for a matrix that is not finite; NaN says so.

Svd svd(ConstMatrixRef M) {
  if (!all_finite(M)) {
    const Index r = std::min(M.rows(), M.cols());
    return {Matrix::Constant(M.rows(), r, kNan), Vector::Constant(r, kNan), Matrix::Constant(M.cols(), r, kNan)};
  }
  Eigen::BDCSVD<Matrix> d(M, Eigen::ComputeThinU | Eigen::ComputeThinV);
  return {d.matrixU(), d.singularValues(), d.matrixV()};
}

ComplexVector eigenvalues(ConstMatrixRef A) { return Eigen::EigenSolver<Matrix>(A, false).eigenvalues(); }

double spectral_radius(ConstMatrixRef A) {
  if (A.rows() == 0) return 0;
  if (!all_finite(A)) return kNan;
  return eigenvalues(A).cwiseAbs().maxCoeff();
}

Spectrum eigen_decomposition(ConstMatrixRef A) {
  if (!all_finite(A))
    return {ComplexVector::Constant(A.rows(), kNan), ComplexMatrix::Constant(A.rows(), A.rows(), kNan)};
  Eigen::EigenSolver<Matrix> d(A, true);
  return {d.eigenvalues(), d.eigenvectors()};
}

SymmetricEigen symmetric_eigen(ConstMatrixRef S) {
  if (!all_finite(S)) return {Vector::Constant(S.rows(), kNan), Matrix::Constant(S.rows(), S.rows(), kNan)};
  Eigen::SelfAdjointEigenSolver<Matrix> d(S);
  return {d.eigenvalues(), d.eigenvectors()};
}

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

Matrix matrix_exponential(ConstMatrixRef A) { return Matrix(A).exp(); }

}  // namespace wheelhop
