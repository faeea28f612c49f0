/// \file
/// Linear models of a plant about an operating point: continuous matrices, modes, exact discretisation.
#pragma once

#include <string>
#include <vector>

#include "core/base/status.hpp"
#include "core/plant/motion.hpp"

namespace wheelhop {

/// x' = A x + B u + B_rate u',  y = C x + D u + D_rate u'  for small changes about the operating point, with
/// x = [q; v; z] (N = 2n + s; z the internal states of laws with memory). The columns for u' are zero unless a
/// rate-dependent law is attached to a displacement input; u' is then the velocity of the drive as `simulate` defines
/// it.
struct LinearPlant {
  Status status = Status::ok;
  std::string message;
  Matrix A;       ///< N x N
  Matrix B;       ///< N x m
  Matrix B_rate;  ///< N x m
  Matrix C;       ///< p x N
  Matrix D;       ///< p x m
  Matrix D_rate;  ///< p x m
};

/// Linearises with the analytic slopes of the laws.
/// @param state N [q; v; z], or 2n [q; v] with all memories at rest, and @param u m inputs: the operating point (drive
/// at rest); empty for zero.
/// Statuses: outside_domain if a law is not defined there; unstable if a pole has a positive real part (all matrices
/// are given, the message names the fastest growth). UserError on wrong sizes. Cost O(n^3).
LinearPlant linearise(const Plant& plant, const Vector& state = {}, const Vector& u = {});

/// Linearises with slopes averaged over the operating points that a motion visits: for a Gaussian one the linear plant
/// of least error (statistical linearisation, Caughey 1963), where the slopes at rest miss what hardens or slides.
/// @param states N x K   @param u m x K, K > 0   Statuses, errors: as linearise. Cost O(n^3 + K n^2).
LinearPlant linearise_along(const Plant& plant, ConstMatrixRef states, ConstMatrixRef u);

struct Mode {
  double frequency_hz = 0;    ///< undamped natural frequency |s| / 2 pi
  double damping_ratio = 0;   ///< -Re(s) / |s|; negative for growth, 1 for a real decaying pole, 0 for s = 0
  std::complex<double> pole;  ///< s [1/s], imaginary part >= 0
};

/// Poles of x' = A x as modes, one for a conjugate pair, by ascending frequency.
std::vector<Mode> modes(ConstMatrixRef A);

struct DiscreteInput {
  Matrix A;  ///< n x n
  Matrix B;  ///< n x m
};

/// x_{k+1} = A_d x_k + B_d u_k for inputs held over `step_s`: the exponential of [[A, B], [0, 0]] step_s. With [B
/// B_rate] for B, the matrices reproduce the held drive and its rate.
DiscreteInput discretise_zoh(ConstMatrixRef A, ConstMatrixRef B, double step_s);

}  // namespace wheelhop
