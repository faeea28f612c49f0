#include "variants/effect/effects.hpp"

namespace wheelhop {

std::shared_ptr<const Effect> make_rate_limit(const EffectOptions&) {
  return effect_family("rate_limit", [](const Plant& plant, std::vector<EffectCandidate>& list) {
    for (const PlantInput& input : plant.inputs) {
      const std::string path = "actuator:" + input.name;
      // What the command reaches is not known here: a fit starts where limits of posts lie, 1 to 2 m/s.
      const double limit = input.kind == InputKind::displacement ? 0.8 : 1e5;
      list.push_back(with_path(plant, "rate_limit", "actuator", "rate", {{path + ".rate_limit", limit, 0.25 * limit}}));
      list.back().proportional = false;
    }
  });
}

}  // namespace wheelhop
