/// \file
/// Cholesky's factorisation in plain and in twice the precision, in vectors as wide as the processor has.
#pragma once

#include "core/base/linalg.hpp"

namespace wheelhop {

/// Rows are stored in groups of so many.
inline constexpr Index kCholeskyRows = 8;
/// Rows that a matrix of order n has in store.
inline Index cholesky_stride(Index n) { return (n + kCholeskyRows - 1) / kCholeskyRows * kCholeskyRows; }

/// Lower factor L of a symmetric positive definite matrix, A = L L', in place.
/// @param a  cholesky_stride(n) x n; in: the lower triangle of A, and anything finite elsewhere; out: that of L, and
///           anything elsewhere
/// @return false where a pivot is not positive. Throws std::invalid_argument where a has another shape.
/// All instruction sets round alike. Cost: n^3 / 6 fused multiply-adds.
bool cholesky_plain(MatrixRef a);

/// The same for A = high + low in twice the precision (Dekker 1971; double_double.hpp), at some thirteen times the
/// cost.
/// @param least_pivot of A; a smaller one ends with false
bool cholesky_extended(MatrixRef high, MatrixRef low, double least_pivot);

}  // namespace wheelhop
