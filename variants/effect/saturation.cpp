#include "variants/effect/effects.hpp"

namespace wheelhop {

std::shared_ptr<const Effect> make_saturation(const EffectOptions&) {
  return effect_family(
      "saturation", [](const Plant& plant, const Operation& operation, std::vector<EffectCandidate>& list) {
        for (Index i = 0; i < plant.input_count(); ++i) {
          const std::string path = "actuator:" + plant.inputs[static_cast<std::size_t>(i)].name;
          for (const double share : {0.6, 0.85}) {  // of the largest command: a limit above it does nothing
            const double limit = share * operation.drive_peak(i);
            if (!(limit > 0)) continue;
            list.push_back(
                with_path(plant, "saturation", "actuator", "stroke", {{path + ".saturation", limit, 0.1 * limit}}));
            list.back().proportional = false;
          }
        }
      });
}

}  // namespace wheelhop
