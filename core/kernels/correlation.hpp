/// \file
/// Sums of products of two sequences at many lags: where the time of a block-Hankel factorisation goes.
#pragma once

#include "core/base/linalg.hpp"

namespace wheelhop {

/// Sequences have this many samples more than are asked for, so that whole vectors may be read.
inline constexpr Index kCorrelationPadding = 8;

/// sums(f, l) += sum over k < count of fixed_f(k) moving(k + l)  for every l < lags.
/// @param fixed   pointers to `fixed_count` sequences of `count` samples, zero from there to the next multiple of 8
/// @param moving  count + lags - 1 samples and padding, all finite
/// @param sums    fixed_count x lags, one row a fixed sequence
/// Eight partial sums a number, added up in one order: AVX2 and AVX-512, chosen when the program runs, give the same
/// bits. Cost: fixed_count lags count multiply-adds.
void add_correlations(const double* const* fixed, Index fixed_count, const double* moving, Index lags, Index count,
                      double* sums);

/// The same in twice the precision: high + low is the sum to about 2^-100 of the sum of the moduli. Each product is
/// split exactly by a fused multiply-add, and what a sum rounds off is summed too (Ogita, Rump & Oishi 2005, Dot2).
/// Cost: ten operations in place of one.
void add_correlations_extended(const double* const* fixed, Index fixed_count, const double* moving, Index lags,
                               Index count, double* high, double* low);

}  // namespace wheelhop
