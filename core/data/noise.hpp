/// \file
/// Measurement noise for simulated records.
#pragma once

#include "core/base/random.hpp"
#include "core/data/signal.hpp"

namespace wheelhop {

/// Adds white Gaussian noise to every output: standard deviation = RMS of the clean output (over all samples, mean
/// kept) times 10^(-snr_db / 20), in the unit of the output.
/// @param snr_db signal-to-noise ratio in dB; +infinity adds nothing
/// @return the standard deviations, p. Numbers are drawn sample by sample, so a longer record begins like a shorter
/// one. Throws std::invalid_argument if snr_db is NaN or -infinity.
Vector add_noise(Signal& signal, double snr_db, Random& random);

}  // namespace wheelhop
