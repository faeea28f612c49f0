/// \file
/// B, D, initial state and output offset by linear least squares once A and C are known (Westwick & Verhaegen 1996, as
/// the paper's Sec. 2.3 cites it; the offset column goes with Remark 1).
#pragma once

#include "core/model/linear.hpp"

namespace wheelhop {

struct InputMatrices {
  LinearModel model;  ///< A and C as given, B, D, y0 estimated
  Vector x0;          ///< n
  Index rank = 0;     ///< numerical rank of the regression, n m + n + p m + p if full
  double condition = 0;
};

/// Minimises ||y - C A^k x0 - sum_j C A^(k-1-j) B u_j - D u_k - y0|| over B, D, x0, y0, all outputs equally weighted.
/// @param A n x n, spectral radius < 1   @param C p x n   @param u m x N   @param y p x N
/// @param direct_inputs the first so many inputs have a direct term; the columns of D for the others are zero
/// Cost O(N p (n m + n)^2); memory independent of N beyond the data.
InputMatrices estimate_input_matrices(ConstMatrixRef A, ConstMatrixRef C, ConstMatrixRef u, ConstMatrixRef y,
                                      Index direct_inputs);

/// x0 and y0 alone, by least squares on the simulated outputs with A, B, C and D as they stand in the model.
/// @param u m x N   @param y p x N   @param model A n x n stable; its y0 is overwritten   @param x0 n out
/// Cost O(N p (n + p)^2).
void estimate_start(ConstMatrixRef u, ConstMatrixRef y, LinearModel& model, Vector& x0);

/// Initial state alone, for a known linear model: least squares on the `samples` samples after the first `skip`.
Vector estimate_initial_state(const LinearModel& model, ConstMatrixRef u, ConstMatrixRef y, Index samples,
                              Index skip = 0);

}  // namespace wheelhop
