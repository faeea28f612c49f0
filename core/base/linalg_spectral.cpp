#include <Eigen/Dense>
#include <limits>
#include <unsupported/Eigen/MatrixFunctions>

#include "core/base/linalg.hpp"
#include "core/base/random.hpp"

namespace wheelhop {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
constexpr Index kMoreVectors = 8;  // beyond those asked for: what the iteration converges by
constexpr int kRounds = 20;

Matrix orthonormal(const Matrix& M) {
  return Eigen::HouseholderQR<Matrix>(M).householderQ() * Matrix::Identity(M.rows(), M.cols());
}

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

Vector singular_values(ConstMatrixRef M) {
  const Index n = std::min(M.rows(), M.cols());
  if (n == 0) return Vector();
  if (!all_finite(M)) return Vector::Constant(n, kNan);
  const double size = M.cwiseAbs().maxCoeff();
  if (size == 0) return Vector::Zero(n);
  const Matrix tall = (M.rows() >= M.cols() ? Matrix(M) : Matrix(M.transpose())) / size;
  const Eigen::internal::UpperBidiagonalization<Matrix> reduced(tall);
  auto bidiagonal = reduced.bidiagonal();
  Vector between(2 * n - 1);  // d_1, e_1, d_2, e_2, ..., d_n beside a diagonal of zeros
  for (Index i = 0; i < n; ++i) {
    between(2 * i) = bidiagonal.diagonal<0>()(i);
    if (i + 1 < n) between(2 * i + 1) = bidiagonal.diagonal<1>()(i);
  }
  Eigen::SelfAdjointEigenSolver<Matrix> solver;
  solver.computeFromTridiagonal(Vector::Zero(2 * n), between, Eigen::EigenvaluesOnly);
  if (solver.info() != Eigen::Success) return svd(M).s;
  return size * solver.eigenvalues().tail(n).reverse().cwiseMax(0);
}

Matrix leading_left_vectors(ConstMatrixRef M, Index count) {
  const Index least = std::min(M.rows(), M.cols()), width = count + kMoreVectors;
  if (!all_finite(M) || 2 * width >= least) return svd(M).U.leftCols(count);
  Random random(1, Stream::parameters);
  Matrix Q = orthonormal(M * random.normal(M.cols(), width));
  for (int round = 0; round < kRounds; ++round) {
    const Svd inside = svd(M.transpose() * Q);  // V' of Q'M, its singular values, and U' of its rotation of Q
    const Matrix U = Q * inside.V.leftCols(count);
    const Matrix left = M * inside.U.leftCols(count) - U * inside.s.head(count).asDiagonal();
    if (left.norm() <= 4 * kEpsilon * std::sqrt(static_cast<double>(M.rows())) * inside.s(0)) return U;
    Q = orthonormal(M * inside.U);
  }
  return svd(M).U.leftCols(count);
}

ComplexVector eigenvalues(ConstMatrixRef A) {
  if (A.rows() == 0) return {};
  return Eigen::EigenSolver<Matrix>(A, false).eigenvalues();
}

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
