#include <Eigen/Dense>
#include <limits>
#include <unsupported/Eigen/MatrixFunctions>

#include "core/base/linalg.hpp"

namespace wheelhop {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// Largest over smallest norm that is not zero.
double range_of(const Vector& norms) {
  const double largest = norms.maxCoeff();
  const double least = (norms.array() > 0).select(norms, largest).minCoeff();
  return largest > 0 ? largest / least : 1;
}

/// Eigen's divide-and-conquer reads beyond its arrays, or gives wrong vectors, on some matrices whose rows or columns
/// are of sizes 1e30 and more apart (3.4.0; seen at 1e90). Those whose smallest row drowns in the rounding of the
/// largest go another way: Jacobi's.
bool is_graded(ConstMatrixRef M) {
  const double size = M.cwiseAbs().maxCoeff();
  if (!(size > 0)) return false;
  const double limit = 1 / std::numeric_limits<double>::epsilon();
  return !(range_of((M / size).rowwise().norm()) < limit && range_of((M / size).colwise().norm().transpose()) < limit);
}

}  // namespace

// Eigen's iterative decompositions leave their results unset for a matrix that is not finite; NaN says so.

Svd svd(ConstMatrixRef M) {
  if (!all_finite(M)) {
    const Index r = std::min(M.rows(), M.cols());
    return {Matrix::Constant(M.rows(), r, kNan), Vector::Constant(r, kNan), Matrix::Constant(M.cols(), r, kNan)};
  }
  if (is_graded(M)) {
    const Eigen::JacobiSVD<Matrix> d(M, Eigen::ComputeThinU | Eigen::ComputeThinV);
    return {d.matrixU(), d.singularValues(), d.matrixV()};
  }
  const Eigen::BDCSVD<Matrix> d(M, Eigen::ComputeThinU | Eigen::ComputeThinV);
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
