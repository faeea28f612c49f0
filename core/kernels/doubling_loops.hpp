/// \file
/// The doubling of solve_dare() over a type V of eight lanes, compiled once for each instruction set. As in
/// correlation_loops.hpp nothing here is left to the linker, functions of <cmath> that are inline included.
///
/// Matrices are n x n, their columns `stride` apart. `stride` is a multiple of 8, and rows and columns from n to the
/// next multiple of 8 are stored as zeros, so that no loop has a remainder.
#pragma once

#include <cmath>
#include <cstddef>

#include "core/kernels/kernel_sets.hpp"

namespace wheelhop {
namespace {

/// Columns of a product that are made at once. It divides 8.
constexpr std::ptrdiff_t kTile = 4;

/// Rows row .. row + 8 Groups - 1 and columns c .. c + kTile - 1 of `result`, plus those of A B.
template <class V, int Groups>
[[gnu::always_inline]] inline void add_tile(const double* a, const double* b, const std::ptrdiff_t* offsets,
                                            std::ptrdiff_t step, double* result, std::ptrdiff_t n,
                                            std::ptrdiff_t stride) {
  V sum[kTile][Groups];
  for (int c = 0; c < kTile; ++c)
    for (int g = 0; g < Groups; ++g) sum[c][g] = V::load(result + c * stride + 8 * g);
  for (std::ptrdiff_t k = 0; k < n; ++k) {
    V x[Groups];
    for (int g = 0; g < Groups; ++g) x[g] = V::load(a + k * stride + 8 * g);
    for (int c = 0; c < kTile; ++c) {
      const V by = V::all(b[offsets[k] + c * step]);
      for (int g = 0; g < Groups; ++g) sum[c][g].add_product(x[g], by);
    }
  }
  for (int c = 0; c < kTile; ++c)
    for (int g = 0; g < Groups; ++g) sum[c][g].store(result + c * stride + 8 * g);
}

/// result += A B, where B(k, c) = b[offsets[k] + c step]: one loop for B as it is, with its rows in another order, and
/// for its transpose.
template <class V, int Groups>
[[gnu::always_inline]] inline void add_product(const double* a, const double* b, const std::ptrdiff_t* offsets,
                                               std::ptrdiff_t step, double* result, std::ptrdiff_t n,
                                               std::ptrdiff_t stride) {
  std::ptrdiff_t row = 0;
  for (; row + 8 * Groups <= stride; row += 8 * Groups)
    for (std::ptrdiff_t c = 0; c < n; c += kTile)
      add_tile<V, Groups>(a + row, b + c * step, offsets, step, result + c * stride + row, n, stride);
  for (; row < stride; row += 8)
    for (std::ptrdiff_t c = 0; c < n; c += kTile)
      add_tile<V, 1>(a + row, b + c * step, offsets, step, result + c * stride + row, n, stride);
}

/// The first `steps` steps of an elimination for Columns columns x: step k takes x(pivots[k]) times the k-th column of
/// `factors` from x. The factors stay in the cache while all steps are done for a few columns.
template <class V, int Columns>
[[gnu::always_inline]] inline void follow(double* x, const double* factors, const std::ptrdiff_t* pivots,
                                          std::ptrdiff_t steps, std::ptrdiff_t stride) {
  for (std::ptrdiff_t k = 0; k < steps; ++k) {
    V by[Columns];
    for (int c = 0; c < Columns; ++c) by[c] = V::all(x[c * stride + pivots[k]]);
    for (std::ptrdiff_t row = 0; row < stride; row += 8) {
      const V factor = V::load(factors + k * stride + row);
      for (int c = 0; c < Columns; ++c) {
        V rows = V::load(x + c * stride + row);
        rows.subtract_product(factor, by[c]);
        rows.store(x + c * stride + row);
      }
    }
  }
}

/// W becomes the factors of its Gauss-Jordan elimination with partial pivoting, for follow(). No row is moved: row k of
/// a solution is found in row pivots[k].
template <class V>
[[gnu::always_inline]] inline void factorise(double* w, std::ptrdiff_t* pivots, std::ptrdiff_t n,
                                             std::ptrdiff_t stride) {
  for (std::ptrdiff_t i = 0; i < n; ++i) pivots[i] = i;
  for (std::ptrdiff_t k = 0; k < n; ++k) {
    double* const column = w + k * stride;
    const std::ptrdiff_t panel = k / kTile * kTile;
    if (k == panel)
      follow<V, kTile>(column, w, pivots, k, stride);
    else
      for (std::ptrdiff_t j = panel; j < k; ++j) follow<V, 1>(column, w + j * stride, pivots + j, 1, stride);
    std::ptrdiff_t best = k;
    for (std::ptrdiff_t i = k + 1; i < n; ++i)
      if (__builtin_fabs(column[pivots[i]]) > __builtin_fabs(column[pivots[best]])) best = i;
    const std::ptrdiff_t pivot = pivots[best];
    pivots[best] = pivots[k];
    pivots[k] = pivot;
    const double scale = 1 / column[pivot];
    const V all = V::all(scale);
    for (std::ptrdiff_t row = 0; row < stride; row += 8) V::load(column + row).times(all).store(column + row);
    column[pivot] = 1 - scale;  // The row of the pivot is divided by it.
  }
}

/// Sum of x(i) y(i) over whole vectors.
template <class V>
[[gnu::always_inline]] inline double dot(const double* x, const double* y, std::ptrdiff_t count) {
  V sum = V::all(0);
  for (std::ptrdiff_t i = 0; i < count; i += 8) sum.add_product(V::load(x + i), V::load(y + i));
  double lanes[8];
  sum.store(lanes);
  return ((lanes[0] + lanes[4]) + (lanes[2] + lanes[6])) + ((lanes[1] + lanes[5]) + (lanes[3] + lanes[7]));
}

/// See Doubling in kernel_sets.hpp.
template <class V, int Groups>
[[gnu::always_inline]] inline DoublingEnd doubling(double* a, double* g, double* h, double* work, std::ptrdiff_t n,
                                                   std::ptrdiff_t stride, int most, double round_off) {
  const std::ptrdiff_t whole = stride * stride;
  double *w = work, *v = w + whole, *m = v + whole, *turned = m + whole, *next = turned + whole;
  std::ptrdiff_t in_order[kMostDoubled], across[kMostDoubled], order[kMostDoubled];
  for (std::ptrdiff_t k = 0; k < n; ++k) {
    in_order[k] = k;
    across[k] = k * stride;
  }
  const auto copy = [&](const double* from, double* to) {
    for (std::ptrdiff_t i = 0; i < whole; ++i) to[i] = from[i];
  };
  const auto zero = [&](double* x) {
    for (std::ptrdiff_t i = 0; i < whole; ++i) x[i] = 0;
  };
  // V = (I + G H)^-1 A and M = (I + G H)^-1 G, their rows in `order`.
  const auto solve = [&] {
    zero(w);
    for (std::ptrdiff_t i = 0; i < n; ++i) w[i * stride + i] = 1;
    add_product<V, Groups>(g, h, in_order, stride, w, n, stride);
    copy(a, v);
    copy(g, m);
    factorise<V>(w, order, n, stride);
    for (std::ptrdiff_t c = 0; c < n; c += kTile) {
      follow<V, kTile>(v + c * stride, w, order, n, stride);
      follow<V, kTile>(m + c * stride, w, order, n, stride);
    }
  };
  DoublingEnd end;
  for (bool converged = false; !converged && end.doublings < most; ++end.doublings) {
    solve();
    for (std::ptrdiff_t j = 0; j < n; ++j)
      for (std::ptrdiff_t i = 0; i < n; ++i) turned[i * stride + j] = a[j * stride + i];
    zero(w);
    add_product<V, Groups>(h, v, order, stride, w, n, stride);
    add_product<V, Groups>(turned, w, in_order, stride, h, n, stride);  // H += A' H V
    zero(w);
    add_product<V, Groups>(a, m, order, stride, w, n, stride);
    add_product<V, Groups>(w, a, across, 1, g, n, stride);  // G += A M A'
    zero(next);
    add_product<V, Groups>(a, v, order, stride, next, n, stride);  // A = A V
    double* const before = a;
    a = next;
    next = before;
    const double size = dot<V>(a, a, whole);
    end.finite = __builtin_isfinite(size);
    // The next increase of H is A' H (I + G H)^-1 A, at most ||A||^2 ||H||.
    converged = !(size > round_off);
  }
  zero(w);
  end.finite = end.finite && dot<V>(g, w, whole) == 0 && dot<V>(h, w, whole) == 0;
  if (!end.finite) return end;
  // A = (I + G P) times the power of the closed loop.
  solve();
  end.power = std::sqrt(dot<V>(v, v, whole));
  return end;
}

}  // namespace
}  // namespace wheelhop
