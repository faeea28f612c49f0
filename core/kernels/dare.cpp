#include "core/kernels/dare.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cstdint>
#include <stdexcept>

#include "core/kernels/kernel_sets.hpp"

namespace wheelhop {
namespace {

#ifdef __x86_64__
Doubling* const doubling_by_lanes = widest<Doubling>(nullptr, doubling_avx2, doubling_avx512);
#else
Doubling* const doubling_by_lanes = nullptr;
#endif

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

/// Doubling by products and factors in blocks.
DoublingEnd doubling_in_blocks(Matrix& A, Matrix& G, Matrix& H) {
  const Index n = A.rows();
  Matrix W(n, n), V(n, n), M(n, n), product(n, n);
  const auto solve = [&] {
    W.noalias() = G * H;
    W.diagonal().array() += 1;
    const Eigen::PartialPivLU<Eigen::Ref<Matrix>> lu(W);
    V = lu.solve(A);
    M = lu.solve(G);
  };
  DoublingEnd end;
  for (bool converged = false; !converged && end.doublings < kDoublings; ++end.doublings) {
    solve();
    W.noalias() = H * V;
    H.noalias() += A.transpose() * W;
    W.noalias() = A * M;
    G.noalias() += W * A.transpose();
    product.noalias() = A * V;
    A.swap(product);
    converged = !(A.squaredNorm() > kRoundOff);
  }
  end.finite = all_finite(A) && all_finite(G) && all_finite(H);
  if (!end.finite) return end;
  solve();
  end.power = V.norm();
  return end;
}

/// Doubling of the dual equation, whose dynamics are A'. @param H Q on entry, the solution on return
DoublingEnd double_up(const Matrix& A, const Matrix& G, Matrix& H) {
  const Index n = A.rows();
  if (doubling_by_lanes == nullptr || n > kMostDoubled) {
    Matrix powers = A.transpose(), gram = G;
    return doubling_in_blocks(powers, gram, H);
  }
  const Index stride = (n + 7) / 8 * 8, whole = stride * stride;
  constexpr Index kLine = 8;  // numbers in a line of the cache, to which the loops want matrices aligned
  Vector memory = Vector::Zero(3 * whole + doubling_work(stride) + kLine);
  const auto address = reinterpret_cast<std::uintptr_t>(memory.data()) / sizeof(double);
  double* const aligned = memory.data() + (kLine - static_cast<Index>(address % kLine)) % kLine;
  double *const a = aligned, *const g = a + whole, *const h = g + whole, *const work = h + whole;
  const auto part = [&](double* first) { return Eigen::Map<Matrix>(first, stride, stride).topLeftCorner(n, n); };
  part(a) = A.transpose();
  part(g) = G;
  part(h) = H;
  const DoublingEnd end = doubling_by_lanes(a, g, h, work, n, stride, kDoublings, kRoundOff);
  H = part(h);
  return end;
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
  const Matrix G = whitened.transpose() * whitened;
  Matrix H = inverse.asDiagonal() * Q * inverse.asDiagonal();
  const DoublingEnd end = double_up(scaled_A, G, H);
  solution.doublings = end.doublings;
  solution.radius_bound = bound_of(end.power, end.doublings);
  if (!end.finite) {
    solution.P = H;
    solution.message = "doubling overflowed: no stabilising solution, or entries of very different size";
    return solution;
  }
  solution.P = 0.5 * (d.asDiagonal() * (H + H.transpose()) * d.asDiagonal());
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
