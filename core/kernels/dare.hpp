/// \file
/// Discrete algebraic Riccati equation by the structure-preserving doubling algorithm.
#pragma once

#include <string>

#include "core/base/linalg.hpp"
#include "core/base/status.hpp"

namespace wheelhop {

struct DareSolution {
  Status status = Status::failed;
  std::string message;
  Matrix P;                       ///< n x n, symmetric positive semidefinite
  double relative_residual = 0;   ///< ||right side - P||_F / ||P||_F
  double closed_loop_radius = 0;  ///< largest |eigenvalue| of A - K C, K the predictor gain
  int doublings = 0;
};

/// Filter form  P = A P A' - A P C' (C P C' + R)^-1 C P A' + Q,  the stabilising solution (the paper's Sec. 2.5).
/// @param A n x n   @param C p x n   @param Q n x n symmetric PSD   @param R p x p symmetric PD
/// Status: not_stabilisable if the closed loop has an eigenvalue within 1e-7 of the unit circle or outside (the pair
/// (C, A) is undetectable, or (A, Q) has an uncontrollable mode on the circle); iteration_limit after 60 doublings;
/// not_finite on overflow or a singular step. std::invalid_argument on shapes only.
/// Cost O(n^3) a doubling, quadratic convergence (linear for an eigenvalue on the circle).
/// Source: Chu, Fan, Lin & Wang 2004, "Structure-preserving algorithms for periodic discrete-time algebraic Riccati
/// equations", Int. J. Control 77(8), on the dual (A', C', Q, R).
DareSolution solve_dare(ConstMatrixRef A, ConstMatrixRef C, ConstMatrixRef Q, ConstMatrixRef R);

}  // namespace wheelhop
