#include "core/kernels/dare.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <stdexcept>

namespace wheelhop {
namespace {

constexpr int kDoublings = 30;
constexpr double kRoundOff = 0x1p-53;
/// A mode on the circle halves the powers at every doubling, so that they pass for converged after 27 of them; its
/// bound is then within 1.4e-7 of one. A stable mode of 1 - 6e-7 has a bound below 1 - 3e-7.
constexpr double kCircle = 3e-7;
/// A residual above this is worth a correction; rounding of the residual itself leaves about 1e-15.
constexpr double kResidual = 4e-15;
/// Half the digits: with a larger residual P is no solution. The doubling ends in one where an unstable mode is seen by
/// rounding alone.
constexpr double kNoSolution = 1e-8;

/// Powers of two d with which rows and columns of D^-1 A D are of about one size (Osborne 1960).
Vector balance(ConstMatrixRef A) {
  const Index n = A.rows();
  Vector d = Vector::Ones(n);
  bool changed = true;
  for (int sweep = 0; sweep < 3 && changed; ++sweep) {
    changed = false;
    for (Index i = 0; i < n; ++i) {
      double row = 0, column = 0;
      for (Index j = 0; j < n; ++j)
        if (j != i) {
          row += std::abs(A(i, j)) * d(j);
          column += std::abs(A(j, i)) / d(j);
        }
      const double square = row / (column * d(i) * d(i));
      if (!(square > 4 || square < 0.25) || !(row > 0 && column > 0)) continue;
      d(i) *= std::exp2(std::round(0.5 * std::log2(square)));
      changed = true;
    }
  }
  return all_finite(d) ? d : Vector::Ones(n);
}

double bound_of(double norm_of_power, int doublings) { return std::pow(norm_of_power, std::exp2(-doublings)); }

/// X = W^-1 X and Y = W^-1 Y, by Gauss-Jordan elimination with partial pivoting; W is lost. For sizes known to the
/// compiler every column is a few registers.
template <class Square>
void eliminate(Square& W, Square& X, Square& Y) {
  constexpr int n = Square::RowsAtCompileTime;
  for (int k = 0; k < n; ++k) {
    int pivot = k;
    for (int i = k + 1; i < n; ++i)
      if (std::abs(W(i, k)) > std::abs(W(pivot, k))) pivot = i;
    if (pivot != k) {
      W.row(k).swap(W.row(pivot));
      X.row(k).swap(X.row(pivot));
      Y.row(k).swap(Y.row(pivot));
    }
    const double scale = 1 / W(k, k);
    Eigen::Matrix<double, n, 1> factor = W.col(k) * scale;
    factor(k) = 1 - scale;  // what is left of the row itself is its pivot's share
    for (int j = k + 1; j < n; ++j) W.col(j) -= W(k, j) * factor;
    for (int j = 0; j < n; ++j) X.col(j) -= X(k, j) * factor;
    for (int j = 0; j < n; ++j) Y.col(j) -= Y(k, j) * factor;
  }
}

void eliminate(Matrix& W, Matrix& X, Matrix& Y) {
  const Eigen::PartialPivLU<Eigen::Ref<Matrix>> lu(W);
  X = lu.solve(X).eval();
  Y = lu.solve(Y).eval();
}

/// The doubling itself, on n x n matrices or, for a size known to the compiler, on those with rows and columns of zeros
/// added, which stand for states that are always zero. In: A the transposed dynamics, G = C' R^-1 C, H = Q. Out: H the
/// solution.
template <class Square>
struct Doubling {
  Square A, G, H;
  int doublings = 0;
  double power = 0;  // norm of the 2^doublings-th power of the closed loop
  bool finite = true;

  void run() {
    Square W(A), V(A), M(A), product(A);
    for (bool converged = false; finite && !converged && doublings < kDoublings; ++doublings) {
      W.noalias() = G * H;
      W.diagonal().array() += 1;
      V = A;
      M = G;
      eliminate(W, V, M);  // V = (I + G H)^-1 A, M = (I + G H)^-1 G
      W.noalias() = H * V;
      product.noalias() = A.transpose() * W;
      H += 0.5 * (product + product.transpose());
      W.noalias() = A * M;
      product.noalias() = W * A.transpose();
      G += 0.5 * (product + product.transpose());
      product.noalias() = A * V;
      A.swap(product);
      const double size = A.squaredNorm();
      finite = std::isfinite(size) && std::isfinite(H.sum()) && std::isfinite(G.sum());
      // The next increase is A' H (I + G H)^-1 A, at most ||A||^2 ||H||.
      converged = size <= kRoundOff;
    }
    if (!finite) return;
    // A = (I + G P) times the power of the closed loop.
    W.noalias() = G * H;
    W.diagonal().array() += 1;
    V = A;
    M.setZero();
    eliminate(W, V, M);
    power = V.norm();
  }
};

template <class Square>
void double_up(const Matrix& A, const Matrix& G, const Matrix& Q, DareSolution& solution, bool& finite) {
  const Index n = A.rows(), size = std::max<Index>(n, Square::RowsAtCompileTime);
  Doubling<Square> doubling;
  doubling.A = doubling.G = doubling.H = Square::Zero(size, size);
  doubling.A.topLeftCorner(n, n) = A.transpose();
  doubling.G.topLeftCorner(n, n) = G;
  doubling.H.topLeftCorner(n, n) = Q;
  doubling.run();
  solution.P = doubling.H.topLeftCorner(n, n);
  solution.doublings = doubling.doublings;
  solution.radius_bound = bound_of(doubling.power, doubling.doublings);
  finite = doubling.finite;
}

/// Right side less P, and the closed loop if it is asked for.
Matrix residual_of(ConstMatrixRef A, ConstMatrixRef C, ConstMatrixRef Q, ConstMatrixRef R, const Matrix& P,
                   Matrix* closed) {
  const Matrix CP = C * P, S = CP * C.transpose() + R, AP = A * P;
  const Matrix CPA = CP * A.transpose();
  const Matrix gain = S.ldlt().solve(CPA);  // transposed
  if (closed != nullptr) *closed = A - gain.transpose() * C;
  Matrix left = Q - P;
  left.noalias() += AP * A.transpose();
  left.noalias() -= gain.transpose() * CPA;
  return left;
}

double relative(const Matrix& residual, const Matrix& P) {
  const double size = P.norm();
  return size > 0 ? residual.norm() / size : residual.norm();
}

}  // namespace

DareSolution solve_dare(ConstMatrixRef A, ConstMatrixRef C, ConstMatrixRef Q, ConstMatrixRef R) {
  const Index n = A.rows(), p = C.rows();
  if (A.cols() != n || C.cols() != n || Q.rows() != n || Q.cols() != n || R.rows() != p || R.cols() != p)
    throw std::invalid_argument("solve_dare: A n x n, C p x n, Q n x n and R p x p do not fit together");
  DareSolution solution;
  solution.status = Status::not_finite;
  const Eigen::LLT<Matrix> root(R);
  if (root.info() != Eigen::Success || !all_finite(A) || !all_finite(C) || !all_finite(Q)) {
    solution.message = "R is not positive definite, or an argument is not finite";
    return solution;
  }
  // x = D z:  D^-1 A D, C D, D^-1 Q D^-1.
  const Vector d = balance(A), inverse = d.cwiseInverse();
  const Matrix scaled_A = inverse.asDiagonal() * A * d.asDiagonal();
  Matrix whitened = C * d.asDiagonal();
  root.matrixL().solveInPlace(whitened);
  const Matrix G = whitened.transpose() * whitened, H = inverse.asDiagonal() * Q * inverse.asDiagonal();
  bool finite = true;
  if (n <= 4)
    double_up<Eigen::Matrix<double, 4, 4>>(scaled_A, G, H, solution, finite);
  else if (n <= 8)
    double_up<Eigen::Matrix<double, 8, 8>>(scaled_A, G, H, solution, finite);
  else if (n <= 12)
    double_up<Eigen::Matrix<double, 12, 12>>(scaled_A, G, H, solution, finite);
  else
    double_up<Matrix>(scaled_A, G, H, solution, finite);
  if (!finite) {
    solution.message = "doubling overflowed: no stabilising solution, or entries of very different size";
    return solution;
  }
  solution.P = (0.5 * (d.asDiagonal() * (solution.P + solution.P.transpose()) * d.asDiagonal())).eval();
  const bool stable = solution.radius_bound < 1 - kCircle;
  Matrix closed;
  Matrix residual = residual_of(A, C, Q, R, solution.P, &closed);
  solution.relative_residual = relative(residual, solution.P);
  if (stable && solution.relative_residual > kResidual) {
    // A step of Newton's method, whose Lyapunov equation is summed up as far as a thousandth needs (Kleinman 1968).
    Matrix sum = residual, power = std::move(closed), product(n, n);
    for (int k = 0; k < solution.doublings && power.squaredNorm() > 1e-3; ++k) {
      product.noalias() = power * sum;
      sum.noalias() += product * power.transpose();
      product.noalias() = power * power;
      power.swap(product);
    }
    sum += solution.P;
    const Matrix corrected = 0.5 * (sum + sum.transpose());
    residual = residual_of(A, C, Q, R, corrected, nullptr);
    if (const double size = relative(residual, corrected); size < solution.relative_residual) {
      solution.P = corrected;
      solution.relative_residual = size;
    }
  }
  if (!std::isfinite(solution.relative_residual)) {
    solution.message = "the solution is not finite";
  } else if (!stable) {
    solution.status = Status::not_stabilisable;
    solution.message = "closed-loop eigenvalue on the unit circle";
  } else if (solution.relative_residual > kNoSolution) {
    solution.status = Status::not_stabilisable;
    solution.message = "an unstable mode that the outputs do not see";
  } else {
    solution.status = Status::ok;
  }
  return solution;
}

LyapunovSolution solve_lyapunov(ConstMatrixRef A, ConstMatrixRef Q) {
  const Index n = A.rows();
  if (A.cols() != n || Q.rows() != n || Q.cols() != n) throw std::invalid_argument("solve_lyapunov: A and Q are n x n");
  LyapunovSolution solution;
  Matrix power = A, P = Q, product(n, n), next(n, n);
  double size = power.norm();
  while (std::isfinite(size) && size * size > kRoundOff && solution.doublings < kDoublings) {
    product.noalias() = power * P;
    next.noalias() = product * power.transpose();
    P += next;
    product.noalias() = power * power;
    power.swap(product);
    size = power.norm();
    ++solution.doublings;
  }
  solution.radius_bound = bound_of(size, solution.doublings);
  if (!std::isfinite(size) || !all_finite(P)) {
    solution.status = Status::not_finite;
    solution.message = "doubling overflowed: A is unstable, or an argument is not finite";
    return solution;
  }
  solution.P = 0.5 * (P + P.transpose());
  const double whole = solution.P.norm();
  const double off = (A * solution.P * A.transpose() + Q - solution.P).norm();
  solution.relative_residual = whole > 0 ? off / whole : off;
  const bool stable = solution.radius_bound < 1 - kCircle;
  solution.status = stable ? Status::ok : Status::not_stabilisable;
  if (!stable) solution.message = "an eigenvalue of A on the unit circle or outside";
  return solution;
}

}  // namespace wheelhop
