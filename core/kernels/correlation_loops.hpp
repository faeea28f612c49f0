/// \file
/// The loops of add_correlations() over a type of eight lanes, compiled once for each instruction set. Everything here
/// has internal linkage or is always inlined: the linker must not take a function that was compiled for AVX-512 for the
/// one of other files.
#pragma once

#include <cstddef>
#include <utility>

#include "core/kernels/double_double.hpp"

namespace wheelhop {
namespace {

using Count = std::ptrdiff_t;
constexpr Count kLanes = 8;

/// The order in which halves of vectors are added, so that every instruction set rounds alike.
inline double sum_of_lanes(const double* lanes) {
  return ((lanes[0] + lanes[4]) + (lanes[2] + lanes[6])) + ((lanes[1] + lanes[5]) + (lanes[3] + lanes[7]));
}

DoubleDouble sum_of_lanes(const double* high, const double* low) {
  DoubleDouble sum;
  for (Count i = 0; i < kLanes; ++i) sum = sum + two_sum(high[i], low[i]);
  return sum;
}

void keep(const double* high, const double* low, double& sum_high, double& sum_low) {
  const DoubleDouble sum = DoubleDouble{sum_high, sum_low} + sum_of_lanes(high, low);
  sum_high = sum.high;
  sum_low = sum.low;
}

/// Fixed x Lags sums in registers. V::at<L>() is the vector L samples after the one at hand, made from the latter and
/// its successor or loaded, whichever the instruction set does better.
template <class V, int Fixed, int Lags>
[[gnu::always_inline]] inline void tile(const double* const* fixed, const double* moving, Count count, double* sums,
                                        Count stride) {
  V sum[Fixed][Lags];
  for (int f = 0; f < Fixed; ++f)
    for (int l = 0; l < Lags; ++l) sum[f][l] = V::zero();
  V here = V::load(moving);
  for (Count k = 0; k < count; k += kLanes) {
    V x[Fixed];
    for (int f = 0; f < Fixed; ++f) x[f] = V::load(fixed[f] + k);
    const double* const p = moving + k;
    const V next = V::load(p + kLanes);
    [&]<int... L>(std::integer_sequence<int, L...>) {
      const auto add = [&](int l, const V& y) {
        for (int f = 0; f < Fixed; ++f) sum[f][l].add_product(x[f], y);
      };
      (add(L, V::template at<L>(here, next, p)), ...);
    }
    (std::make_integer_sequence<int, Lags>());
    here = next;
  }
  for (int f = 0; f < Fixed; ++f)
    for (int l = 0; l < Lags; ++l) sums[f * stride + l] += sum[f][l].total();
}

/// The last lags, fewer than make a whole tile.
template <class V, int Fixed, int Lags>
[[gnu::always_inline]] inline void last_lags(const double* const* fixed, const double* moving, Count lags, Count count,
                                             double* sums, Count stride) {
  if constexpr (Lags > 0) {
    if (lags == Lags)
      tile<V, Fixed, Lags>(fixed, moving, count, sums, stride);
    else
      last_lags<V, Fixed, Lags - 1>(fixed, moving, lags, count, sums, stride);
  }
}

template <class V, int Fixed, int Lags>
[[gnu::always_inline]] inline void all_lags(const double* const* fixed, const double* moving, Count lags, Count count,
                                            double* sums) {
  Count l = 0;
  for (; l + Lags <= lags; l += Lags) tile<V, Fixed, Lags>(fixed, moving + l, count, sums + l, lags);
  last_lags<V, Fixed, Lags - 1>(fixed, moving + l, lags - l, count, sums + l, lags);
}

template <class V, int Lags>
[[gnu::always_inline]] inline void tile_extended(const double* fixed, const double* moving, Count count, double* high,
                                                 double* low) {
  V h[Lags], r[Lags];
  for (int l = 0; l < Lags; ++l) h[l] = r[l] = V::zero();
  for (Count k = 0; k < count; k += kLanes) {
    const V x = V::load(fixed + k);
    for (int l = 0; l < Lags; ++l) V::add_exactly(h[l], r[l], x, V::load(moving + k + l));
  }
  for (int l = 0; l < Lags; ++l) {
    double lanes_high[kLanes], lanes_low[kLanes];
    h[l].store(lanes_high);
    r[l].store(lanes_low);
    keep(lanes_high, lanes_low, high[l], low[l]);
  }
}

template <class V, int Lags>
[[gnu::always_inline]] inline void all_lags_extended(const double* fixed, const double* moving, Count lags, Count count,
                                                     double* high, double* low) {
  Count l = 0;
  for (; l + Lags <= lags; l += Lags) tile_extended<V, Lags>(fixed, moving + l, count, high + l, low + l);
  for (; l < lags; ++l) tile_extended<V, 1>(fixed, moving + l, count, high + l, low + l);
}

}  // namespace
}  // namespace wheelhop
