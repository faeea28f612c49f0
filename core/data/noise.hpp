/// \file
/// Measurement noise for simulated records.
#pragma once

#include <optional>

#include "core/base/random.hpp"
#include "core/data/signal.hpp"

namespace wheelhop {

/// Adds Gaussian noise to every output: standard deviation = RMS of the clean output (over all samples, mean
/// kept) times 10^(-snr_db / 20), in the unit of the output.
/// @param snr_db signal-to-noise ratio in dB; +infinity adds nothing
/// @param corner_hz none: white; else white noise w through a first-order low-pass with this corner, stationary from
/// the first sample on:  v_k = a v_(k-1) + sqrt(1 - a^2) w_k,  v_0 = w_0,  a = exp(-2 pi corner_hz T)
/// @return the standard deviations, p. Numbers are drawn sample by sample, so a longer record begins like a shorter
/// one. Throws std::invalid_argument if snr_db is NaN or -infinity.
Vector add_noise(Signal& signal, double snr_db, Random& random, std::optional<double> corner_hz = {});

}  // namespace wheelhop
