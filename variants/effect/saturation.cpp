#include "variants/effect/effects.hpp"

namespace wheelhop {

std::shared_ptr<const Effect> make_saturation(const EffectOptions&) {
  return effect_family(
      "saturation", [](const Plant& plant, const Operation& operation, std::vector<EffectCandidate>& list) {
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
