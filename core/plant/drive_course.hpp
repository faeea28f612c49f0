/// \file
/// A drive between its samples, where it is not held: a smooth curve through all of them.
#pragma once

#include <algorithm>
#include <array>

#include "core/base/linalg.hpp"

namespace wheelhop {

/// The drive over one interval: u(s) = c[0] + c[1] s + c[2] s^2 + c[3] s^3, s in [0, 1] the fraction of the interval
/// that has passed.
template <class T>
struct DrivePiece {
  std::array<T, 4> c;
  T value(T s) const { return c[0] + s * (c[1] + s * (c[2] + s * c[3])); }
  /// Slope per interval.
  T slope(T s) const { return c[1] + s * (T(2.0) * c[2] + s * T(3.0) * c[3]); }
};

/// The cubic Hermite piece between samples k and k + 1 of a drive, with slopes by central differences of fourth order,
/// m_k = (8 (u_{k+1} - u_{k-1}) - (u_{k+2} - u_{k-2})) / 12. Value and slope are continuous from piece to piece. With T
/// the interval, its error for a sine of angular frequency w is of the order (w T)^4 / 384 of the amplitude, and
/// (w T)^4 / 30 in the slope. The drive is continued beyond its ends by odd reflection. F. N. Fritsch, R. E. Carlson,
/// SIAM J. Numer. Anal. 17 (1980) 238, for the form.
/// @param at function of the sample's number   @param last number of the last sample, >= 0
template <class At>
DrivePiece<double> smooth_piece(At at, Index k, Index last) {
  const auto sample = [&](Index j) {
    if (j < 0) return 2 * at(Index{0}) - at(std::min(-j, last));
    if (j > last) return 2 * at(last) - at(std::max<Index>(2 * last - j, 0));
    return static_cast<double>(at(j));
  };
  const double before2 = sample(k - 2), before = sample(k - 1), u0 = sample(k), u1 = sample(k + 1),
               after = sample(k + 2), after2 = sample(k + 3);
  const double m0 = (8 * (u1 - before) - (after - before2)) / 12, m1 = (8 * (after - u0) - (after2 - before)) / 12;
  return {{u0, m0, 3 * (u1 - u0) - 2 * m0 - m1, 2 * (u0 - u1) + m0 + m1}};
}

}  // namespace wheelhop
