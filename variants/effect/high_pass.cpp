#include "variants/effect/effects.hpp"

namespace wheelhop {
namespace {

// Judgements. The coupling of accelerometers with built-in electronics has its corner between 0.05 and 3 Hz or so; a
// fit starts at kCorner, in the middle of that, and a plan asks of kTypical whether a test would show it.
constexpr double kCorner = 0.3, kTypical = 0.5;  // Hz
// Nine of ten corners lie between these, with charge amplifiers and the AC inputs of recorders. One that is far slower
// than a record acts in it as a bias does.
constexpr double kLeast = 0.01, kMost = 5;  // Hz

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
      plausibly(list.back(), "high_pass_hz", kLeast, kMost);
    }
  });
}

}  // namespace wheelhop
