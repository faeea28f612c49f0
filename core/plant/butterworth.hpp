/// \file
/// Butterworth low-pass as second-order sections.
#pragma once

#include <vector>

#include "core/base/linalg.hpp"

namespace wheelhop {

/// y_k = b0 x_k + b1 x_{k-1} + b2 x_{k-2} - a1 y_{k-1} - a2 y_{k-2}
struct Biquad {
  double b0 = 1, b1 = 0, b2 = 0, a1 = 0, a2 = 0;
};

/// Low-pass of the given order with gain 1 at zero and 1/sqrt(2) at `cutoff_hz` exactly: bilinear transform of each
/// pole pair with the cutoff prewarped. Sections rather than one polynomial: at 10 Hz of 1000 Hz the coefficients of an
/// eighth-order polynomial cancel to the last digit.
/// @param cutoff_hz below half of `rate_hz`. Source: S. Butterworth 1930; Oppenheim & Schafer, bilinear transform.
std::vector<Biquad> butterworth_lowpass(Index order, double cutoff_hz, double rate_hz);

/// Filters in place, from rest.
void filter(const std::vector<Biquad>& sections, VectorRef x);

}  // namespace wheelhop
