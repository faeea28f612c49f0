#include "variants/effect/effects.hpp"

namespace wheelhop {
namespace {

// The coupling of accelerometers with built-in electronics has its corner between 0.05 and 3 Hz or so. Both numbers are
// judgements from the middle of that.
constexpr double kCorner = 0.3;   // Hz, where a fit starts
constexpr double kTypical = 0.5;  // Hz, of which a plan asks whether a test would show it

}  // namespace

std::shared_ptr<const Effect> make_high_pass(const EffectOptions&) {
  return effect_family("high_pass", [](const Plant& plant, const Operation&, std::vector<EffectCandidate>& list) {
    for (const Sensor& sensor : plant.sensors) {
      if (sensor.path.high_pass_hz > 0) continue;
      const Place at = sensor_place(sensor.name);
      const std::string place = to_string(at);
      list.push_back(
          with_path(plant, "high_pass", at, "AC coupling", {{place + ".high_pass_hz", kCorner, 0.5 * kCorner}}));
      typically(list.back(), "high_pass_hz", kTypical);
    }
  });
}

}  // namespace wheelhop
