#include "variants/effect/effects.hpp"

namespace wheelhop {

namespace {

/// Deviations of a gain from one, of nine in ten: a judgement about the 1 to 3 % that calibration leaves. What is off
/// by more than itself has a wrong unit or sign, or something else is wrong.
constexpr double kLeastDeviation = 0.003, kMostDeviation = 0.3;

}  // namespace

std::shared_ptr<const Effect> make_gain_error(const EffectOptions&) {
  return effect_family("gain_error", [](const Plant& plant, const Operation&, std::vector<EffectCandidate>& list) {
    for (const PlantInput& input : plant.inputs) {
      const std::string path = "actuator:" + input.name;
      list.push_back(with_path(plant, "gain_error", actuator_of(plant, input), "gain", {{path + ".gain", 1.02, 0.02}}));
      list.back().ideal = 1;
      list.back().either_sign = true;
      defined_by(list.back(), "gain", kLeastDeviation, kMostDeviation);
    }
    for (const Sensor& sensor : plant.sensors) {
      const Place at = sensor_place(sensor.name);
      const std::string place = to_string(at);
      list.push_back(with_path(plant, "gain_error", at, "gain", {{place + ".gain", 1.02, 0.02}}));
      list.back().ideal = 1;
      list.back().either_sign = true;
      defined_by(list.back(), "gain", kLeastDeviation, kMostDeviation);
    }
  });
}

}  // namespace wheelhop
