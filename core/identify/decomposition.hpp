/// \file
/// The linear/nonlinear decomposition of the paper's eqs. (3)-(4).
#pragma once

#include "core/base/linalg.hpp"

namespace wheelhop {

/// The particular choice of A, B whose remainder is uncorrelated with input and state.
struct Decomposition {
  Matrix A;                ///< r32 r22^-1
  Matrix B;                ///< (r31 - r32 r22^-1 r21) r11^-1
  Matrix r33;              ///< n x n; its rank is the number of nonlinear directions
  Vector singular_values;  ///< of r33 / sqrt(N - 1), in units of the states
  Index rank = 0;          ///< those above `threshold` times the first
  double share = 0;        ///< RMS of the remainder over that of x_{k+1}
};

/// RQ factorisation of [1; u_k; x_k; x_{k+1}], eq. (4), with the constant row of Remark 1.
/// @param x n x N states, scaled to comparable size   @param u m x N
/// @param threshold relative; 0.1 by default because intersample behaviour alone makes the second value about 5 % of
/// the first for a single nonlinearity.
Decomposition decompose(ConstMatrixRef x, ConstMatrixRef u, double threshold = 0.1);

}  // namespace wheelhop
