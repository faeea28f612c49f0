/// \file
/// Commands of the drives as sums of cosines: known at every instant, so that a delay or another clock reads them
/// exactly where a sampled command would have to be interpolated, and going on before and after any record.
#pragma once

#include <numbers>
#include <string>
#include <vector>

#include "core/base/random.hpp"

namespace wheelhop::blind {

inline constexpr double two_pi = 2 * std::numbers::pi;

struct Cosine {
  double amplitude = 0, frequency_hz = 0, phase = 0;
};

using Command = std::vector<Cosine>;

struct DriveShape {
  std::string name = "multisine";  ///< multisine, iso8608, band_limited_10hz
  double rms = 0.008;              ///< unit of the input
  double from_hz = 0.3, to_hz = 25;
  double period_s = 20;  ///< of a multisine
};

const std::vector<std::string>& drive_names();

/// multisine: every line of 1 / period, amplitudes falling as 1 / f (white speed); iso8608: the same spectrum (waviness
/// 2), lines at random places of their intervals, so that nothing repeats; band_limited_10hz: flat up to 10 Hz, without
/// period. The RMS is that of the sum over infinite time.
Command make_command(const DriveShape& shape, Random& random);

/// Values at t = start + k step, k = 0 ... count - 1. Cost O(lines * count) complex products.
Vector sample_command(const Command& command, double start_s, double step_s, Index count);

}  // namespace wheelhop::blind
