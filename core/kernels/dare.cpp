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

/// Powers of two d with which rows and columns of D^-1 A D are of about one size (Osborne 1960).
Vector balance(ConstMatrixRef A) {
  const Index n = A.rows();
  Vector d = Vector::Ones(n);
  for (int sweep = 0; sweep < 3; ++sweep)
    for (Index i = 0; i < n; ++i) {
      double row = 0, column = 0;
      for (Index j = 0; j < n; ++j)
        if (j != i) {
          row += std::abs(A(i, j)) * d(j);
          column += std::abs(A(j, i)) / d(j);
        }
      if (!(row > 0 && column > 0)) continue;
      const double factor = std::sqrt(row / (d(i) * column * d(i)));
      if (factor > 2 || factor < 0.5) d(i) *= std::exp2(std::round(std::log2(factor)));
    }
  return all_finite(d) ? d : Vector::Ones(n);
}

double bound_of(double norm_of_power, int doublings) { return std::pow(norm_of_power, std::exp2(-doublings)); }

/// The doubling itself. In: A the transposed dynamics, G = C' R^-1 C, H = Q. Out: H the solution.
template <int N>
struct Doubling {
  using Square = Eigen::Matrix<double, N, N>;
  Square A, G, H;
  int doublings = 0;
  double power = 0;  // norm of the 2^doublings-th power of the closed loop
  bool finite = true, converged = false;

  void run() {
    const Index n = A.rows();
    Square W(n, n), V(n, n), HV(n, n), next(n, n);
    Eigen::PartialPivLU<Square> lu(n);
    while (finite && !converged && doublings < kDoublings) {
      W.noalias() = G * H;
      W.diagonal().array() += 1;
      lu.compute(W);
      V = lu.solve(A);  // (I + G H)^-1 A
      HV.noalias() = H * V;
      next.noalias() = A.transpose() * HV;
      H += next;
      H = (0.5 * (H + H.transpose())).eval();
      HV.noalias() = A * V;  // the next A
      W = lu.solve(G);
      V.noalias() = A * W;
      next.noalias() = V * A.transpose();
      G += next;
      G = (0.5 * (G + G.transpose())).eval();
      A.swap(HV);
      ++doublings;
      power = A.norm();
      finite = std::isfinite(power) && std::isfinite(H.sum()) && std::isfinite(G.sum());
      // The next increase is A' H (I + G H)^-1 A, at most ||A||^2 ||H||.
      converged = power * power <= kRoundOff;
    }
    if (finite) {
      W.noalias() = G * H;
      W.diagonal().array() += 1;
      lu.compute(W);
      power = lu.solve(A).norm();
    }
  }
};

template <int N>
void solve_scaled(const Matrix& A, const Matrix& G, const Matrix& Q, DareSolution& solution, bool& finite) {
  Doubling<N> doubling{A.transpose(), G, Q};
  doubling.run();
  solution.P = doubling.H;
  solution.doublings = doubling.doublings;
  solution.radius_bound = bound_of(doubling.power, doubling.doublings);
  finite = doubling.finite;
}

void solve_scaled(const Matrix& A, const Matrix& G, const Matrix& Q, DareSolution& solution, bool& finite) {
  switch (A.rows()) {
    case 1: return solve_scaled<1>(A, G, Q, solution, finite);
    case 2: return solve_scaled<2>(A, G, Q, solution, finite);
    case 3: return solve_scaled<3>(A, G, Q, solution, finite);
    case 4: return solve_scaled<4>(A, G, Q, solution, finite);
    case 5: return solve_scaled<5>(A, G, Q, solution, finite);
    case 6: return solve_scaled<6>(A, G, Q, solution, finite);
    case 7: return solve_scaled<7>(A, G, Q, solution, finite);
    case 8: return solve_scaled<8>(A, G, Q, solution, finite);
    default: return solve_scaled<Eigen::Dynamic>(A, G, Q, solution, finite);
  }
}

double residual_of(ConstMatrixRef A, ConstMatrixRef C, ConstMatrixRef Q, ConstMatrixRef R, const Matrix& P) {
  const Matrix CP = C * P;
  const Matrix S = CP * C.transpose() + R;
  const Matrix K = S.ldlt().solve(CP * A.transpose());  // the gain, transposed
  Matrix right = A * P;
  right = (right * A.transpose()).eval();
  right.noalias() -= K.transpose() * (CP * A.transpose());
  right += Q;
  const double size = P.norm();
  return size > 0 ? (right - P).norm() / size : right.norm();
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
  const Matrix whitened = root.matrixL().solve(C * d.asDiagonal());
  const Matrix G = whitened.transpose() * whitened;
  bool finite = true;
  solve_scaled(scaled_A, G, inverse.asDiagonal() * Q * inverse.asDiagonal(), solution, finite);
  if (!finite) {
    solution.message = "doubling overflowed: no stabilising solution, or entries of very different size";
    return solution;
  }
  solution.P = (d.asDiagonal() * solution.P * d.asDiagonal()).eval();
  solution.relative_residual = residual_of(A, C, Q, R, solution.P);
  if (!std::isfinite(solution.relative_residual)) {
    solution.message = "the solution is not finite";
  } else if (!(solution.radius_bound < 1 - kCircle)) {
    solution.status = Status::not_stabilisable;
    solution.message = "closed-loop eigenvalue on the unit circle";
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
