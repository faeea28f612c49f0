/// \file
/// A tone in what a plant leaves of its records: hum of the mains, a pump or a wheel out of balance. A law of a plant
/// makes one out of a drive that does not have it only as a multiple of the drive's own tone.
#pragma once

#include <string>
#include <vector>

#include "core/greybox/plant_fit.hpp"

namespace wheelhop {

/// What a diagnosis tells beside its answer; no verdict depends on it.
struct Tone {
  bool seen = false;
  std::string channel;
  double frequency_hz = 0;
  double share = 0;  ///< of the squared error of the channel, its mean left out
  int multiple = 0;  ///< how many times the frequency of a drive that is one tone; 0: no such drive, or no multiple
};

/// The tone that makes most of the error of a channel in the longest record: five lines of a spectrum under a Hann
/// window, three periods or more from zero, with half of its power. Not seen where the same lines have a fifth of the
/// power of a drive, where no drive moves, or near a natural frequency of the plant at which it rings by itself. Of
/// several channels that with the largest error over the noise.
/// @param fit of `records`   Cost: an FFT a channel and drive.
Tone tone_of(const PlantFit& fit, const std::vector<FitRecord>& records);

}  // namespace wheelhop
