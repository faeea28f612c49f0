// Effects of sensors and of the recorder's clock that came after the first sets of cases had been sealed.
#include <algorithm>
#include <cmath>

#include "experiments/rig/effects.hpp"

namespace wheelhop::blind {
namespace {

/// Toward a limit: x / (1 + |x / limit|^power)^(1 / power).
double bent(double x, double limit, double power) {
  return x / std::pow(1 + std::pow(std::abs(x / limit), power), 1 / power);
}

/// How sharply an amplifier meets its supply: from an early bend to nearly a corner.
double drawn_power(Random& random) { return log_between(random, 4, 12); }

std::string reading_unit(const Surroundings& rig, Index sensor) {
  return rig.plan->sensors[static_cast<std::size_t>(sensor)].unit;
}

/// Sizes of clips are the RMS of the reading over the limit: from five times the RMS, which a Gaussian reading hardly
/// ever reaches, down to less than the RMS.
constexpr double least_clip = 0.2, most_clip = 1.3;

template <class Clip>
std::optional<Formed> clipped(const Surroundings& rig, const std::string& place, Clip clip) {
  const Index i = sensor_at(*rig.plan, place);
  const double level = rig.sensor_rms(i);
  if (!(level > 0)) return std::nullopt;
  return Formed{least_clip, most_clip, [=, unit = reading_unit(rig, i)](double size) {
                  const double limit = level / size;
                  const auto step = [=](Matrix& y, Index, double) {
                    for (double& value : y.row(i)) value = clip(value, limit);
                  };
                  return TrueEffect{.strength = limit, .unit = unit, .sensors = {step}};
                }};
}

std::optional<Formed> soft_clip(const Surroundings& rig, const std::string& place, Random& random) {
  return clipped(rig, place,
                 [power = drawn_power(random)](double value, double limit) { return bent(value, limit, power); });
}

std::optional<Formed> hard_clip(const Surroundings& rig, const std::string& place, Random&) {
  return clipped(rig, place, [](double value, double limit) { return std::clamp(value, -limit, limit); });
}

/// Sizes of slew limits are the RMS of the reading's rate over the limit.
constexpr double least_slew = 0.2, most_slew = 2;

/// Follows the reading from sample to sample, by at most what `bounded` makes of the rate wanted.
template <class Bounded>
std::optional<Formed> slewed(const Surroundings& rig, const std::string& place, Bounded bounded) {
  const Index i = sensor_at(*rig.plan, place);
  const double level = rig.sensor_rate_rms(i);
  if (!(level > 0)) return std::nullopt;
  return Formed{least_slew, most_slew, [=, unit = reading_unit(rig, i)](double size) {
                  const double limit = level / size;
                  const auto step = [=](Matrix& y, Index, double rate) {
                    for (Index k = 1; k < y.cols(); ++k)
                      y(i, k) = y(i, k - 1) + bounded((y(i, k) - y(i, k - 1)) * rate, limit) / rate;
                  };
                  return TrueEffect{.strength = limit, .unit = unit + "/s", .sensors = {step}};
                }};
}

std::optional<Formed> soft_slew(const Surroundings& rig, const std::string& place, Random& random) {
  return slewed(rig, place,
                [power = drawn_power(random)](double wanted, double limit) { return bent(wanted, limit, power); });
}

std::optional<Formed> hard_slew(const Surroundings& rig, const std::string& place, Random&) {
  return slewed(rig, place, [](double wanted, double limit) { return std::clamp(wanted, -limit, limit); });
}

/// Sizes of late readings are their delays in seconds, from those of a converter to those of a loaded bus.
constexpr double least_late = 2e-4, most_late = 0.06;

/// A reading of some time ago. @param wander share of the delay by which it swings, with a period of seven seconds
std::optional<Formed> late(const Surroundings& rig, const std::string& place, double wander) {
  const Index i = sensor_at(*rig.plan, place);
  return Formed{least_late, most_late, [=](double size) {
                  const auto step = [=](Matrix& y, Index, double rate) {
                    const Matrix prompt = y.row(i);
                    for (Index k = 0; k < y.cols(); ++k) {
                      const double at = static_cast<double>(k), now = size * (1 + wander * std::sin(0.9 * at / rate));
                      y(i, k) = read_at(prompt, std::max(at - now * rate, 0.0))(0);
                    }
                  };
                  return TrueEffect{.strength = size, .unit = "s", .sensors = {step}};
                }};
}

std::optional<Formed> late_reading(const Surroundings& rig, const std::string& place, Random&) {
  return late(rig, place, 0);
}

std::optional<Formed> wandering_bus(const Surroundings& rig, const std::string& place, Random& random) {
  return late(rig, place, log_between(random, 0.01, 0.05));
}

/// Sizes of couplings are their corners in Hz.
constexpr double least_corner = 0.005, most_corner = 3;

/// The high-pass of a capacitor and a resistor on row i, s / (s + 2 pi corner_hz), by the bilinear transform with its
/// corner prewarped.
void couple(Matrix& y, Index i, double corner_hz, double rate) {
  const double g = std::tan(M_PI * corner_hz / rate);
  double before = y(i, 0), held = 0;
  for (Index k = 0; k < y.cols(); ++k) {
    const double now = y(i, k);
    held = (now - before + (1 - g) * held) / (1 + g);
    before = now;
    y(i, k) = held;
  }
}

std::optional<Formed> coupled(const Surroundings& rig, const std::string& place, std::vector<double> stages) {
  const Index i = sensor_at(*rig.plan, place);
  return Formed{least_corner, most_corner, [=](double size) {
                  const auto step = [=](Matrix& y, Index, double rate) {
                    for (const double stage : stages) couple(y, i, stage * size, rate);
                  };
                  return TrueEffect{.strength = size, .unit = "Hz", .sensors = {step}};
                }};
}

std::optional<Formed> one_coupling(const Surroundings& rig, const std::string& place, Random&) {
  return coupled(rig, place, {1});
}

/// Sensor and amplifier are each coupled, the amplifier with the lower corner.
std::optional<Formed> two_couplings(const Surroundings& rig, const std::string& place, Random& random) {
  return coupled(rig, place, {1, log_between(random, 0.05, 0.5)});
}

/// The recorder's quartz is off: its samples lie further apart, or less far, than it says. The command it writes is
/// that of the drive's own, right clock.
std::optional<Formed> recorder_clock(const Surroundings&, const std::string&, Random& random) {
  const double sign = either_sign(random);
  return Formed{1e-7, 5e-3, [=](double size) {
                  return TrueEffect{.strength = sign * size, .unit = "-", .recorder_rate = 1 + sign * size};
                }};
}

}  // namespace

std::vector<EffectKind> added_path_kinds() {
  return {{"saturation", "reading that bends toward its end", sensor_places, soft_clip},
          {"saturation", "reading cut at its end", sensor_places, hard_clip, true},
          {"rate_limit", "reading whose rate bends toward a bound", sensor_places, soft_slew},
          {"rate_limit", "reading of bounded rate", sensor_places, hard_slew, true},
          {"time_delay", "bus whose delay wanders", sensor_places, wandering_bus},
          {"time_delay", "reading late by a fixed time", sensor_places, late_reading, true},
          {"high_pass", "AC coupling in two stages", sensor_places, two_couplings},
          {"high_pass", "AC coupling in one stage", sensor_places, one_coupling, true},
          {"clock_skew", "clock of the recorder", timebase, recorder_clock}};
}

}  // namespace wheelhop::blind
