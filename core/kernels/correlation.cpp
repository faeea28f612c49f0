// Compiled with -ffp-contract=off: what a fused multiply-add does is written out, and nothing else is fused.
#include "core/kernels/correlation.hpp"

#include "core/kernels/correlation_loops.hpp"
#include "core/kernels/kernel_sets.hpp"

namespace wheelhop {

/// The same sums in the same order, for every other processor.
void plain_portable(const double* const* fixed, Count fixed_count, const double* moving, Count lags, Count count,
                    double* sums) {
  for (Count f = 0; f < fixed_count; ++f)
    for (Count l = 0; l < lags; ++l) {
      double lanes[kLanes] = {};
      for (Count k = 0; k < count; k += kLanes)
        for (Count i = 0; i < kLanes; ++i) lanes[i] = std::fma(fixed[f][k + i], moving[k + l + i], lanes[i]);
      sums[f * lags + l] += sum_of_lanes(lanes);
    }
}

void extended_portable(const double* const* fixed, Count fixed_count, const double* moving, Count lags, Count count,
                       double* high, double* low) {
  for (Count f = 0; f < fixed_count; ++f)
    for (Count l = 0; l < lags; ++l) {
      double lanes_high[kLanes] = {}, lanes_low[kLanes] = {};
      for (Count k = 0; k < count; k += kLanes)
        for (Count i = 0; i < kLanes; ++i) {
          const DoubleDouble p = two_product(fixed[f][k + i], moving[k + l + i]), s = two_sum(lanes_high[i], p.high);
          lanes_high[i] = s.high;
          lanes_low[i] += p.low + s.low;
        }
      keep(lanes_high, lanes_low, high[f * lags + l], low[f * lags + l]);
    }
}

namespace {

Index whole_vectors(Index count) { return (count + kLanes - 1) / kLanes * kLanes; }

#ifdef __x86_64__
PlainCorrelations* const plain = widest(plain_portable, plain_avx2, plain_avx512);
ExtendedCorrelations* const extended = widest(extended_portable, extended_avx2, extended_avx512);
#else
PlainCorrelations* const plain = plain_portable;
ExtendedCorrelations* const extended = extended_portable;
#endif

}  // namespace

void add_correlations(const double* const* fixed, Index fixed_count, const double* moving, Index lags, Index count,
                      double* sums) {
  plain(fixed, fixed_count, moving, lags, whole_vectors(count), sums);
}

void add_correlations_extended(const double* const* fixed, Index fixed_count, const double* moving, Index lags,
                               Index count, double* high, double* low) {
  extended(fixed, fixed_count, moving, lags, whole_vectors(count), high, low);
}

}  // namespace wheelhop
