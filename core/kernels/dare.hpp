/// \file
/// Discrete algebraic Riccati and Lyapunov equations by doubling.
#pragma once

#include <string>

#include "core/base/linalg.hpp"
#include "core/base/status.hpp"

namespace wheelhop {

struct DareSolution {
  Status status = Status::failed;
  std::string message;
  Matrix P;                      ///< n x n, symmetric positive semidefinite
  double relative_residual = 0;  ///< ||right side - P||_F / ||P||_F
  /// Upper bound of the largest |eigenvalue| of A - K C, K the predictor gain: the 2^k-th root of the norm of its
  /// 2^k-th power, which the doubling computes anyway. A few per cent above it at most.
  double radius_bound = 0;
  int doublings = 0;
};

/// Filter form  P = A P A' - A P C' (C P C' + R)^-1 C P A' + Q,  the stabilising solution (the paper's Sec. 2.5).
/// @param A n x n   @param C p x n   @param Q n x n symmetric PSD   @param R p x p symmetric PD
/// States are scaled by powers of two first, so that rows and columns of A are of one size.
/// Status: not_stabilisable if the closed loop has an eigenvalue within about 3e-7 of the unit circle or outside (the
/// pair (C, A) is undetectable, or (A, Q) has an uncontrollable mode on the circle), or the residual stays above 1e-8:
/// P and its residual are then those of the last doubling; not_finite on overflow, a singular R or arguments that are
/// not finite. std::invalid_argument on shapes only. Cost about 17 n^3 a doubling; up to n = 128 by loops of this
/// processor's widest vectors, which take no memory (kernel_sets.hpp). A radius r needs about log2(18 / (1 - r))
/// doublings; at most 30. A residual above 4e-15 gets one step of Newton's method. Source: Chu, Fan, Lin & Wang 2004,
/// "Structure-preserving algorithms for periodic discrete-time algebraic Riccati equations", Int. J. Control 77(8), on
/// the dual (A', C', Q, R).
DareSolution solve_dare(ConstMatrixRef A, ConstMatrixRef C, ConstMatrixRef Q, ConstMatrixRef R);

struct LyapunovSolution {
  Status status = Status::failed;
  std::string message;
  Matrix P;                      ///< n x n, symmetric
  double relative_residual = 0;  ///< ||right side - P||_F / ||P||_F
  double radius_bound = 0;       ///< of A, as in DareSolution
  int doublings = 0;
};

/// P = A P A' + Q  for a stable A, by squaring A (Smith 1968). @param A n x n   @param Q n x n symmetric
/// Status: not_stabilisable if an eigenvalue of A lies within about 3e-7 of the unit circle or outside; not_finite on
/// overflow. std::invalid_argument on shapes only. Cost 3 n^3 a doubling.
LyapunovSolution solve_lyapunov(ConstMatrixRef A, ConstMatrixRef Q);

}  // namespace wheelhop
