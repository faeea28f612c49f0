/// \file
/// The loops of cholesky.hpp over a type V of eight lanes, compiled once for each instruction set, by panels of Columns
/// columns. As in correlation_loops.hpp nothing here is left to the linker.
///
/// An entry of the factor is its entry of A less the products with the columns before it, in their order, over its
/// pivot: the same operations for every width of vectors and panels.
#pragma once

#include <cmath>
#include <cstddef>

#include "core/kernels/double_double.hpp"

namespace wheelhop {
namespace {

/// Rows row .. row + 8 Groups - 1 of a panel at column j, less the products of all columns before it.
template <class V, int Columns, int Groups>
[[gnu::always_inline]] inline void panel_rows(const double* a, std::ptrdiff_t stride, std::ptrdiff_t j,
                                              std::ptrdiff_t row, V (&sum)[Columns][Groups]) {
  for (int c = 0; c < Columns; ++c)
    for (int g = 0; g < Groups; ++g) sum[c][g] = V::load(a + (j + c) * stride + row + 8 * g);
  for (std::ptrdiff_t k = 0; k < j; ++k) {
    const double* const column = a + k * stride;
    V x[Groups];
    for (int g = 0; g < Groups; ++g) x[g] = V::load(column + row + 8 * g);
    for (int c = 0; c < Columns; ++c) {
      const V by = V::all(column[j + c]);
      for (int g = 0; g < Groups; ++g) sum[c][g].subtract_product(x[g], by);
    }
  }
}

/// Finishes rows of a panel with the factor of its first rows, and stores them.
template <class V, int Columns, int Groups>
[[gnu::always_inline]] inline void solve_rows(double* a, std::ptrdiff_t stride, std::ptrdiff_t j, std::ptrdiff_t row,
                                              const double (&pivot)[Columns][Columns], const double (&inverse)[Columns],
                                              V (&sum)[Columns][Groups]) {
  for (int c = 0; c < Columns; ++c)
    for (int g = 0; g < Groups; ++g) {
      sum[c][g] = sum[c][g].times(V::all(inverse[c]));
      for (int d = c + 1; d < Columns; ++d) sum[d][g].subtract_product(sum[c][g], V::all(pivot[d][c]));
      sum[c][g].store(a + (j + c) * stride + row + 8 * g);
    }
}

/// One panel. @return false where a pivot is not positive
template <class V, int Columns, int Groups>
[[gnu::always_inline]] inline bool plain_panel(double* a, std::ptrdiff_t stride, std::ptrdiff_t j) {
  V first[Columns][1];
  panel_rows<V, Columns, 1>(a, stride, j, j / 8 * 8, first);
  double pivot[Columns][Columns], inverse[Columns];
  for (int c = 0; c < Columns; ++c) {
    double lanes[8];
    first[c][0].store(lanes);
    for (int d = 0; d < Columns; ++d) pivot[d][c] = lanes[j % 8 + d];
  }
  for (int c = 0; c < Columns; ++c) {
    if (!(pivot[c][c] > 0) || !__builtin_isfinite(pivot[c][c])) return false;
    inverse[c] = 1 / std::sqrt(pivot[c][c]);
    for (int d = c; d < Columns; ++d) pivot[d][c] *= inverse[c];
    for (int e = c + 1; e < Columns; ++e)
      for (int d = e; d < Columns; ++d) pivot[d][e] = std::fma(-pivot[d][c], pivot[e][c], pivot[d][e]);
  }
  std::ptrdiff_t row = j / 8 * 8;
  for (; row + 8 * Groups <= stride; row += 8 * Groups) {
    V sum[Columns][Groups];
    panel_rows<V, Columns, Groups>(a, stride, j, row, sum);
    solve_rows<V, Columns, Groups>(a, stride, j, row, pivot, inverse, sum);
  }
  for (; row < stride; row += 8) {
    V sum[Columns][1];
    panel_rows<V, Columns, 1>(a, stride, j, row, sum);
    solve_rows<V, Columns, 1>(a, stride, j, row, pivot, inverse, sum);
  }
  return true;
}

template <class V, int Columns, int Groups>
[[gnu::always_inline]] inline bool plain_cholesky(double* a, std::ptrdiff_t n, std::ptrdiff_t stride) {
  std::ptrdiff_t j = 0;
  for (; j + Columns <= n; j += Columns)
    if (!plain_panel<V, Columns, Groups>(a, stride, j)) return false;
  for (; j < n; ++j)
    if (!plain_panel<V, 1, Groups>(a, stride, j)) return false;
  return true;
}

/// Columns j .. j + Columns - 1 in twice the precision, from row `row` on, less the products of the columns before.
template <class V, int Columns>
[[gnu::always_inline]] inline void extended_rows(double* high, double* low, std::ptrdiff_t stride, std::ptrdiff_t j,
                                                 std::ptrdiff_t before, std::ptrdiff_t row) {
  V sum[Columns], rest[Columns];
  for (int c = 0; c < Columns; ++c) {
    sum[c] = V::load(high + (j + c) * stride + row);
    rest[c] = V::load(low + (j + c) * stride + row);
  }
  for (std::ptrdiff_t k = before; k < j; ++k) {
    const V x = V::load(high + k * stride + row), y = V::load(low + k * stride + row);
    for (int c = 0; c < Columns; ++c)
      V::subtract_extended(sum[c], rest[c], x, y, V::all(high[k * stride + j + c]), V::all(low[k * stride + j + c]));
  }
  for (int c = 0; c < Columns; ++c) {
    sum[c].store(high + (j + c) * stride + row);
    rest[c].store(low + (j + c) * stride + row);
  }
}

template <class V, int Columns>
[[gnu::always_inline]] inline bool extended_cholesky(double* high, double* low, std::ptrdiff_t n, std::ptrdiff_t stride,
                                                     double least_pivot) {
  for (std::ptrdiff_t j = 0; j < n; ++j) {
    // A panel is freed of what lies before it at once, then of its own columns one by one.
    const std::ptrdiff_t start = j / Columns * Columns;
    if (j == start && start + Columns <= n)
      for (std::ptrdiff_t row = j / 8 * 8; row < stride; row += 8)
        extended_rows<V, Columns>(high, low, stride, j, 0, row);
    const std::ptrdiff_t before = start + Columns <= n ? start : 0;
    for (std::ptrdiff_t row = j / 8 * 8; row < stride; row += 8) extended_rows<V, 1>(high, low, stride, j, before, row);
    double* const wh = high + j * stride;
    double* const wl = low + j * stride;
    const DoubleDouble pivot = two_sum(wh[j], wl[j]);
    if (!(pivot.high > least_pivot) || !__builtin_isfinite(pivot.high)) return false;
    const DoubleDouble scale = inverse_sqrt(pivot);
    for (std::ptrdiff_t i = j; i < n; ++i) {
      const DoubleDouble value = two_sum(wh[i], wl[i]) * scale;
      wh[i] = value.high;
      wl[i] = value.low;
    }
  }
  return true;
}

}  // namespace
}  // namespace wheelhop
