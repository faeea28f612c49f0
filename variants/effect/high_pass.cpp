#include "variants/effect/effects.hpp"

namespace wheelhop {
namespace {

// AC coupling of accelerometers with built-in electronics: 0.05 to 3 Hz by their data sheets. The corner moves with the
// fit.
constexpr double kCorner = 0.3;   // Hz
constexpr double kTypical = 0.5;  // Hz

}  // namespace

std::shared_ptr<const Effect> make_high_pass(const EffectOptions&) {
  return effect_family("high_pass", [](const Plant& plant, const Operation&, std::vector<EffectCandidate>& list) {
    for (const Sensor& sensor : plant.sensors) {
      if (sensor.path.high_pass_hz > 0) continue;
      const std::string place = "sensor:" + sensor.name;
      list.push_back(
          with_path(plant, "high_pass", place, "AC coupling", {{place + ".high_pass_hz", kCorner, 0.5 * kCorner}}));
      typically(list.back(), "high_pass_hz", kTypical);
    }
  });
}

}  // namespace wheelhop
