/// \file
/// The RQ factorisation of the paper's eq. (11) on block-Hankel matrices, streamed over the record.
#pragma once

#include "core/base/linalg.hpp"

namespace wheelhop {

/// Lower-triangular factor of  [1; U_future; U_past; Y_future]  (rows), eq. (11) with the constant row of Remark 1.
struct HankelRq {
  Matrix R;          ///< L x L lower triangular, L = 1 + m s + m s_past + p s
  Index future = 0;  ///< s, block rows of the future
  Index past = 0;    ///< s_past
  Index m = 0, p = 0;
  Index columns = 0;  ///< samples that entered

  Matrix R22() const { return R.block(1 + m * future, 1 + m * future, m * past, m * past); }
  Matrix R32() const { return R.block(1 + m * (future + past), 1 + m * future, p * future, m * past); }
};

/// @param u m x N   @param y p x N   @param future s   @param past s_past; N >= 2 (future + past) rows' worth of
/// samples Memory O(L^2), cost O(N L^2). Throws std::invalid_argument if N < future + past + L.
HankelRq hankel_rq(ConstMatrixRef u, ConstMatrixRef y, Index future, Index past);

/// Order of persistency of excitation of u: the largest s <= `limit` for which the block-Hankel matrix of s block rows
/// has full row rank relative to `tolerance` (smallest over largest singular value). A constant input has order 1 (0
/// if it is zero), a single sine 2. Uses the Gram matrix of at most `limit` lags: cost O(N m^2 limit).
Index persistency_of_excitation(ConstMatrixRef u, Index limit, double tolerance = 1e-12);

}  // namespace wheelhop
