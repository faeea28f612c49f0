/// \file
/// The tangent between its poles, for a law that has made sure that it stands there.
#pragma once

#include <numbers>

#include "core/plant/lanes.hpp"

namespace wheelhop {

/// tan(a) for |a| < pi / 2, within 6 units in the last place; one division, no branch, so that it takes half the time
/// of the library's and fills vector registers.
///
/// Lambert's continued fraction y / (1 - y^2 / (3 - y^2 / (5 - ... / 17))) as a quotient of polynomials whose
/// coefficients are whole numbers; for |y| <= pi / 4 what it leaves out is 9e-19 of the tangent. Beyond that,
/// tan(a) = 1 / tan(pi / 2 - a). J. H. Lambert, Memoires de l'Academie de Berlin 17 (1761), 265-322.
template <class V>
[[gnu::always_inline]] inline V tan_inside(V a) {
  const V half_pi = std::numbers::pi / 2, rest = 6.123233995736766e-17;  // pi / 2 in two doubles
  const V size = absolute(a);
  const auto far = size > V(std::numbers::pi / 4);
  const V y = choose(far, (half_pi - size) + rest, size);
  const V z = y * y, z2 = z * z;
  const V over = y * ((V(34459425.0) + V(-4729725.0) * z) + z2 * ((V(135135.0) + V(-990.0) * z) + z2));
  const V under = (V(34459425.0) + V(-16216200.0) * z) + z2 * ((V(945945.0) + V(-13860.0) * z) + V(45.0) * z2);
  return with_sign(choose(far, under, over) / choose(far, over, under), a);
}

}  // namespace wheelhop
