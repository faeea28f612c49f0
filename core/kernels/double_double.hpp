/// \file
/// Numbers of twice the precision, as unevaluated sums of two doubles. Needs a compiler that keeps the order of
/// operations and fuses none: compile with -ffp-contract=off. Always inlined, so that files for several instruction
/// sets may use it. Source: Dekker 1971; Knuth, The Art of Computer Programming 2, 4.2.2; Ogita, Rump & Oishi 2005.
#pragma once

#include <cmath>

namespace wheelhop {

struct DoubleDouble {
  double high = 0, low = 0;
};

/// a + b exactly.
[[gnu::always_inline]] inline DoubleDouble two_sum(double a, double b) {
  const double s = a + b, z = s - a;
  return {s, (a - (s - z)) + (b - z)};
}

/// a b exactly.
[[gnu::always_inline]] inline DoubleDouble two_product(double a, double b) {
  const double p = a * b;
  return {p, std::fma(a, b, -p)};
}

[[gnu::always_inline]] inline DoubleDouble operator-(DoubleDouble a) { return {-a.high, -a.low}; }

[[gnu::always_inline]] inline DoubleDouble operator+(DoubleDouble a, DoubleDouble b) {
  const DoubleDouble s = two_sum(a.high, b.high);
  return two_sum(s.high, s.low + a.low + b.low);
}

[[gnu::always_inline]] inline DoubleDouble operator*(DoubleDouble a, DoubleDouble b) {
  const DoubleDouble p = two_product(a.high, b.high);
  return two_sum(p.high, p.low + (a.high * b.low + a.low * b.high));
}

/// 1 / sqrt(a) for a > 0, by one step of Newton's iteration.
[[gnu::always_inline]] inline DoubleDouble inverse_sqrt(DoubleDouble a) {
  const DoubleDouble x{1 / std::sqrt(a.high), 0};
  const DoubleDouble left = DoubleDouble{1, 0} + -(a * (x * x));
  return x + x * (left * DoubleDouble{0.5, 0});
}

}  // namespace wheelhop
