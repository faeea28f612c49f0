#include "variants/effect/effects.hpp"

namespace wheelhop {

std::shared_ptr<const Effect> make_saturation(const EffectOptions&) {
  return effect_family("saturation", [](const Plant& plant, std::vector<EffectCandidate>& list) {
    for (const PlantInput& input : plant.inputs) {
      const std::string path = "actuator:" + input.name;
      const double limit = input.kind == InputKind::displacement ? 0.03 : 1e3;
      list.push_back(
          with_path(plant, "saturation", "actuator", "stroke", {{path + ".saturation", limit, 0.25 * limit}}));
      list.back().proportional = false;
    }
  });
}

}  // namespace wheelhop
