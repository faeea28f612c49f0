/// \file
/// Matrix types and the dense decompositions, compiled once in linalg.cpp (each costs seconds a translation unit).
/// Convention of the whole project: signals are stored one column a sample.
#pragma once

#include <Eigen/Core>
#include <complex>

namespace wheelhop {

using Index = Eigen::Index;
using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;
using ComplexMatrix = Eigen::MatrixXcd;
using ComplexVector = Eigen::VectorXcd;
using MatrixRef = Eigen::Ref<Matrix>;
using VectorRef = Eigen::Ref<Vector>;
using ConstMatrixRef = Eigen::Ref<const Matrix>;
using ConstVectorRef = Eigen::Ref<const Vector>;

struct Svd {
  Matrix U;  ///< m x r, orthonormal columns
  Vector s;  ///< r = min(m, n), descending
  Matrix V;  ///< n x r, orthonormal columns
};

/// Thin singular value decomposition M = U diag(s) V'. All NaN if M is not finite. Cost O(m n min(m, n)).
Svd svd(ConstMatrixRef M);

/// Singular values alone, descending, to the absolute accuracy of `svd` (round-off of the largest): bidiagonalisation,
/// then the eigenvalues of [0 B'; B 0] in its tridiagonal order. G. H. Golub, W. Kahan, SIAM J. Numer. Anal. 2 (1965)
/// 205-224. NaN if M is not finite. Cost 4 m n min(m, n), a tenth of the time of `svd`.
Vector singular_values(ConstMatrixRef M);

/// The first `count` left singular vectors (m x count), as accurate as those of `svd`: orthogonal iteration on a few
/// vectors more, until M v = sigma u and M'u = sigma v hold to round-off of sigma_1, so that a vector is off by that
/// over its gap (P.-A. Wedin, BIT 12 (1972) 99-111); all of `svd` where twenty rounds are not enough.
/// N. Halko, P. G. Martinsson, J. A. Tropp, SIAM Review 53 (2011) 217-288. Cost m n (count + 8) a round, two or three.
Matrix leading_left_vectors(ConstMatrixRef M, Index count);

/// Eigenvalues of a real square matrix, unordered; NaN if A is not finite (so too the decompositions below).
ComplexVector eigenvalues(ConstMatrixRef A);

/// Largest modulus of an eigenvalue of A (n x n); 0 for an empty matrix, NaN if A is not finite.
double spectral_radius(ConstMatrixRef A);

struct Spectrum {
  ComplexVector values;   ///< n
  ComplexMatrix vectors;  ///< n x n, one column an eigenvector
};

/// Eigenvalues and right eigenvectors of a real square matrix.
Spectrum eigen_decomposition(ConstMatrixRef A);

struct SymmetricEigen {
  Vector values;   ///< ascending
  Matrix vectors;  ///< orthonormal columns
};

/// Eigen-decomposition of a symmetric matrix (the lower triangle is read).
SymmetricEigen symmetric_eigen(ConstMatrixRef S);

struct LeastSquares {
  Matrix x;                  ///< n x k minimiser of ||A x - b||; minimum-norm on the numerical null space
  Index rank = 0;            ///< numerical rank of the column-scaled A
  double condition = 0;      ///< ratio of the largest to the smallest pivot kept
  double residual_norm = 0;  ///< Frobenius norm of A x - b
};

/// Least squares by complete orthogonal decomposition with columns scaled to unit norm first.
/// @param A m x n, m >= n   @param b m x k   @param tolerance relative pivot below which a direction is dropped.
LeastSquares least_squares(ConstMatrixRef A, ConstMatrixRef b, double tolerance = 1e-12);

/// Upper triangular factor (n x n) of the QR decomposition of A (m x n, m >= n), diagonal made non-negative.
Matrix qr_upper(ConstMatrixRef A);

/// Solution of A X = B by partially pivoted LU (A n x n, B n x k).
Matrix solve(ConstMatrixRef A, ConstMatrixRef B);

ComplexMatrix solve_complex(const ComplexMatrix& A, const ComplexMatrix& B);

struct ThinQr {
  ComplexMatrix Q;  ///< m x n, orthonormal columns
  ComplexMatrix R;  ///< n x n, upper triangular
};

/// Thin QR factorisation of a complex A (m x n, m >= n).
ThinQr thin_qr(const ComplexMatrix& A);

/// Lower Cholesky factor of a symmetric positive definite matrix; an empty matrix if S is not positive definite.
Matrix cholesky_lower(ConstMatrixRef S);

/// Symmetric square root T of a positive semidefinite S: S = T T. Negative round-off eigenvalues count as zero.
Matrix symmetric_sqrt(ConstMatrixRef S);

/// Matrix exponential.
Matrix matrix_exponential(ConstMatrixRef A);

/// [top; bottom], of equally many columns.
Matrix stacked(ConstMatrixRef top, ConstMatrixRef bottom);

/// Covariance (d x d) of samples about their mean, divided by N. It makes no copy of the samples.
/// @param samples d x N, one a column, N >= 1. Cost O(N d^2)
Matrix covariance_of(ConstMatrixRef samples);

/// True if every entry is finite.
template <class Derived>
bool all_finite(const Eigen::DenseBase<Derived>& M) {
  return M.derived().array().isFinite().all();
}

/// Sets a block that has decayed, as powers of a stable matrix do, to zero once all of it is below 1e-30 of the one it
/// began at: it adds nothing to sums that hold its beginning, and as denormal numbers, which it would become, a
/// processor reckons with it many times slower.
template <class Block>
void drop_faded(Block&& block) {
  if (block.size() > 0 && block.cwiseAbs().maxCoeff() < 1e-30) block.setZero();
}

}  // namespace wheelhop
