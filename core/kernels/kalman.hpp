/// \file
/// Steady-state Kalman predictor and the innovation-based read-outs of its state.
#pragma once

#include "core/kernels/dare.hpp"

namespace wheelhop {

/// x_{k+1} = A x_k + w_k, z_k = C x_k + v_k, cov w = Q, cov v = R, with the stationary gain.
struct KalmanFilter {
  Status status = Status::failed;
  std::string message;
  Matrix A, C;
  Matrix K;  ///< n x p predictor gain, A P C' S^-1
  Matrix P;  ///< n x n predictor covariance
  Matrix S;  ///< p x p innovation covariance, C P C' + R
  Matrix S_inverse;
  double spectral_radius = 0;  ///< of A - K C; a bound of it where the status is not ok
};

KalmanFilter design_kalman_filter(ConstMatrixRef A, ConstMatrixRef C, ConstMatrixRef Q, ConstMatrixRef R);

struct FilterRun {
  Matrix x;                   ///< n x N one-step-ahead predictions x(k|k-1)
  Matrix e;                   ///< p x N innovations
  double quadratic = 0;       ///< sum e' S^-1 e
  double log_likelihood = 0;  ///< -1/2 sum (e' S^-1 e + log det 2 pi S)
};

/// Runs the predictor from x(0|-1) = x0.
FilterRun run_filter(const KalmanFilter& filter, ConstMatrixRef z, ConstVectorRef x0);

/// x(k|k+lag) from the innovations: x(k|k-1) + P sum_{j=0..lag} (A-KC)'^j C' S^-1 e(k+j), truncated at the end of the
/// record. lag = 0 is the filtered estimate. Cost O(lag N n p).
/// Source: Anderson & Moore 1979, "Optimal Filtering", ch. 7 (smoothing).
Matrix fixed_lag_states(const KalmanFilter& filter, FilterRun run, Index lag);

/// x(k|N-1), the fixed-interval smoother in the form of Bryson & Frazier 1963 (no inverse of P):
/// r_{k-1} = C' S^-1 e_k + (A - K C)' r_k,  x(k|N-1) = x(k|k-1) + P r_{k-1}.  Cost O(N n^2).
Matrix smoothed_states(const KalmanFilter& filter, FilterRun run);

}  // namespace wheelhop
