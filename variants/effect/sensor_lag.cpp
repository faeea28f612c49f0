#include <cmath>

#include "variants/effect/effects.hpp"

namespace wheelhop {
namespace {

// Of the filters of loggers and the mounts of accelerometers; both move with the fit.
constexpr double kCutoff = 80;         // Hz, behind which a Butterworth filter of second order comes 2.8 ms late
constexpr double kDampingRatio = 0.7;  // of that filter

}  // namespace

std::shared_ptr<const Effect> make_sensor_lag(const EffectOptions&) {
  return effect_family("sensor_lag", [](const Plant& plant, const Operation&, std::vector<EffectCandidate>& list) {
    for (const Sensor& sensor : plant.sensors) {
      const Place at = sensor_place(sensor.name);
      const std::string place = to_string(at);
      const Lag& lag = sensor.path.lag;
      // A plant file gives a lag one order, and a second lag of that order is the first with other numbers.
      if (!std::isfinite(lag.cutoff_hz))
        list.push_back(
            with_path(plant, "sensor_lag", at, "first order", {{place + ".lag.time_constant_s", 0.002, 0.001}}));
      if (std::isfinite(lag.cutoff_hz) || lag.time_constant_s > 0) continue;
      list.push_back(with_path(
          plant, "sensor_lag", at, "second order",
          {{place + ".lag.cutoff_hz", kCutoff, 0.25 * kCutoff}, {place + ".lag.damping_ratio", kDampingRatio, 0.2}}));
      list.back().proportional = false;
    }
  });
}

}  // namespace wheelhop
