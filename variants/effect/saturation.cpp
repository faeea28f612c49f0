#include <cmath>

#include "variants/effect/effects.hpp"

namespace wheelhop {
namespace {

/// The end of a sensor's measuring range. Where many readings have just the largest size, that is where it lies; else
/// somewhere below the largest reading that the plant would give: a range beyond it holds nothing.
void add_ends_of_range(const Plant& plant, const Operation& operation, std::vector<EffectCandidate>& list) {
  for (Index i = 0; i < plant.sensor_count(); ++i) {
    const Sensor& sensor = plant.sensors[static_cast<std::size_t>(i)];
    const double peak = operation.output_peak(i), ceiling = operation.output_ceiling(i);
    if (!(peak > 0) || std::isfinite(sensor.path.saturation)) continue;
    const Place at = sensor_place(sensor.name);
    const std::string place = to_string(at);
    const bool seen = ceiling > 0 && ceiling < peak;
    for (const double end : seen ? std::vector{ceiling} : std::vector{0.6 * peak, 0.85 * peak}) {
      list.push_back(with_path(plant, "saturation", at, "end of range", {{place + ".saturation", end, 0.1 * end}}));
      list.back().proportional = false;
    }
    for (const double share : {0.9, 1.5}) {  // an amplifier bends before it ends
      list.push_back(with_path(
          plant, "saturation", at, "soft end",
          {{place + ".saturation", share * peak, 0.2 * share * peak}, {place + ".saturation_sharpness", 4, 1.5}}));
      list.back().proportional = false;
    }
  }
}

}  // namespace

std::shared_ptr<const Effect> make_saturation(const EffectOptions&) {
  return effect_family(
      "saturation", [](const Plant& plant, const Operation& operation, std::vector<EffectCandidate>& list) {
        add_ends_of_range(plant, operation, list);
        for (Index i = 0; i < plant.input_count(); ++i) {
          const PlantInput& input = plant.inputs[static_cast<std::size_t>(i)];
          const std::string path = "actuator:" + input.name;
          const double peak = operation.drive_peak(i);
          if (!(peak > 0)) continue;
          for (const double share : {0.6, 0.85}) {  // of the largest command: a limit above it does nothing
            list.push_back(with_path(plant, "saturation", actuator_of(plant, input), "hard end",
                                     {{path + ".saturation", share * peak, 0.1 * share * peak}}));
            list.back().proportional = false;
            if (input.kind == InputKind::displacement) typically(list.back(), "saturation", 0.03);
          }
          for (const double share : {0.9, 1.5}) {  // a soft end is felt before it is reached
            list.push_back(with_path(
                plant, "saturation", actuator_of(plant, input), "soft end",
                {{path + ".saturation", share * peak, 0.2 * share * peak}, {path + ".saturation_sharpness", 4, 1.5}}));
            list.back().proportional = false;
            if (input.kind == InputKind::displacement) typically(list.back(), "saturation", 0.03);
          }
        }
      });
}

}  // namespace wheelhop
