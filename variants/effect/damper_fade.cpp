#include "variants/effect/effects.hpp"

namespace wheelhop {

std::shared_ptr<const Effect> make_damper_fade(const EffectOptions&) {
  return effect_family("damper_fade", [](const Plant& plant, const Operation&, std::vector<EffectCandidate>& list) {
    for (std::size_t e = 0; e < plant.elements.size(); ++e) {
      const double damping = viscous_damping(plant.elements[e]);
      if (damping <= 0) continue;
      list.push_back(with_law(plant, e, "damper_fade", "heat", "fading_damper", {damping, 0.005, 200, 600},
                              {{"fade_per_k", 0.003}}));
    }
  });
}

}  // namespace wheelhop
