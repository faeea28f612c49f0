/// \file
/// The input matrix of the nonlinearity by the separable least squares of the paper's eq. (17), in the frequency
/// domain.
#pragma once

#include <memory>

#include "core/base/random.hpp"
#include "core/optimise/solver.hpp"

namespace wheelhop {

struct DirectionOptions {
  Index count = 1;          ///< q, number of nonlinearities; needs q < p (Sec. 2.7, assumption 2)
  bool direct_term = true;  ///< estimate Dt beside Bt; false = the paper's eq. (15) as printed
  double cutoff_hz = 25;    ///< bins up to here; the record's own band if lower
  Index starts = 6;
  Index iterations = 60;
};

struct Direction {
  Status status = Status::failed;
  std::string message;
  Matrix Bt;                ///< n x q; [Bt; Dt] has orthonormal columns, signs and rotation are arbitrary
  Matrix Dt;                ///< p x q
  double residual = 0;      ///< RMS of what no f can explain over RMS of z; 0 = trackable, 1 = nothing explained
  Vector channel_residual;  ///< p, RMS of the unexplained part a channel, in the unit of z
  Index agreeing = 0;       ///< starts that ended within 1 % of the best residual
};

/// min over [Bt; Dt] of  sum_bins || (I - G G^+) z ||^2,  G(w) = C (e^{jwT} I - A)^-1 Bt + Dt.
///
/// Multiplying by the Toeplitz matrix of eq. (16) is convolution, hence a product per frequency bin: the projection of
/// eq. (17) splits into p x p problems and the (p N) x (q N) matrix never exists. A Hann window keeps the unknown
/// initial state out. Kaufman's Jacobian (its gradient is exact).
/// @param A n x n   @param C p x n   @param z p x N linear residual, channels of comparable size
/// Status: rank_deficient if q >= p; failed if z is zero.
Direction estimate_direction(ConstMatrixRef A, ConstMatrixRef C, ConstMatrixRef z, double sample_time_s,
                             const DirectionOptions& options, const Solver& solver, Random& random);

/// The problem behind estimate_direction, theta = vec [Bt; Dt] (or vec Bt): exposed for its gradient's test.
std::unique_ptr<ResidualProblem> direction_problem(ConstMatrixRef A, ConstMatrixRef C, ConstMatrixRef z,
                                                   double sample_time_s, const DirectionOptions& options);

}  // namespace wheelhop
