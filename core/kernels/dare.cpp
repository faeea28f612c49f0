#include "core/kernels/dare.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <stdexcept>

namespace wheelhop {
namespace {

constexpr int kDoublings = 60;

void measure(DareSolution& solution, ConstMatrixRef A, ConstMatrixRef C, ConstMatrixRef Q, ConstMatrixRef R) {
  const Matrix& P = solution.P;
  const Matrix S = C * P * C.transpose() + R;
  const Matrix K = S.ldlt().solve(C * P * A.transpose()).transpose();
  const Matrix right = A * P * A.transpose() - K * C * P * A.transpose() + Q;
  const double size = P.norm();
  solution.relative_residual = size > 0 ? (right - P).norm() / size : right.norm();
  solution.closed_loop_radius = spectral_radius(A - K * C);
}

}  // namespace

DareSolution solve_dare(ConstMatrixRef A, ConstMatrixRef C, ConstMatrixRef Q, ConstMatrixRef R) {
  const Index n = A.rows(), p = C.rows();
  if (A.cols() != n || C.cols() != n || Q.rows() != n || Q.cols() != n || R.rows() != p || R.cols() != p)
    throw std::invalid_argument("solve_dare: A n x n, C p x n, Q n x n and R p x p do not fit together");
  DareSolution solution;
  Matrix Ak = A.transpose(), G = C.transpose() * Matrix(R).ldlt().solve(Matrix(C)), H = Q;
  Matrix W(n, n), V1(n, n), V2(n, n);
  for (solution.doublings = 1; solution.doublings <= kDoublings; ++solution.doublings) {
    W.noalias() = G * H;
    W.diagonal().array() += 1;
    const Eigen::PartialPivLU<Matrix> lu(W);
    V1 = lu.solve(Ak);
    V2 = lu.solve(G);
    const Matrix increase = Ak.transpose() * H * V1;
    G += Ak * V2 * Ak.transpose();
    Ak = Ak * V1;
    H += increase;
    H = 0.5 * (H + H.transpose()).eval();
    G = 0.5 * (G + G.transpose()).eval();
    if (!all_finite(H) || !all_finite(Ak)) {
      solution.status = Status::not_finite;
      solution.message = "doubling overflowed: no stabilising solution, or entries of very different size";
      return solution;
    }
    if (increase.norm() <= 1e-15 * H.norm()) break;
  }
  solution.P = H;
  measure(solution, A, C, Q, R);
  if (!std::isfinite(solution.relative_residual) || !std::isfinite(solution.closed_loop_radius)) {
    solution.status = Status::not_finite;
    solution.message = "the solution is not finite";
  } else if (solution.closed_loop_radius >= 1 - 1e-7) {
    solution.status = Status::not_stabilisable;
    solution.message = "closed-loop eigenvalue on the unit circle";
  } else if (solution.doublings > kDoublings) {
    solution.status = Status::iteration_limit;
    solution.message = "no convergence within 60 doublings";
  } else {
    solution.status = Status::ok;
  }
  return solution;
}

}  // namespace wheelhop
