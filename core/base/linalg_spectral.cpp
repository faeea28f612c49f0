#include <Eigen/Dense>
#include <limits>
#include <unsupported/Eigen/MatrixFunctions>

#include "core/base/linalg.hpp"

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
  // Jacobi's method. Eigen's divide and conquer (3.4.0), twice as fast at 120 columns, reads beyond its arrays or gives
  // wrong vectors where singular values cluster or rows differ by 1e30 and more.
  const Eigen::JacobiSVD<Matrix> d(M, Eigen::ComputeThinU | Eigen::ComputeThinV);
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

Matrix matrix_exponential(ConstMatrixRef A) { return Matrix(A).exp(); }

}  // namespace wheelhop
