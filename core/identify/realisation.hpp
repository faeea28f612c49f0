/// \file
/// From the extended observability matrix to A and C, and from singular values to an order.
#pragma once

#include "core/base/linalg.hpp"

namespace wheelhop {

struct OrderChoice {
  Index order = 0;
  double gap = 0;  ///< s_order / s_(order+1)
};

/// Order with the largest ratio of consecutive singular values among 1..max_order.
/// @param singular_values descending
OrderChoice order_from_gap(ConstVectorRef singular_values, Index max_order);

struct ObservabilityPair {
  Matrix A, C;
  bool stabilised = false;
};

/// Shift invariance of eq. (8): C = first block row of Gamma, Gamma(1..s-1) A = Gamma(2..s) in least squares.
/// Eigenvalues on or outside the unit circle are reflected and that is said.
/// @param gamma (p s) x n extended observability matrix   @param p outputs
ObservabilityPair shift_invariance(ConstMatrixRef gamma, Index p);

}  // namespace wheelhop
