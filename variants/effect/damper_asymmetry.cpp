#include "variants/effect/effects.hpp"

namespace wheelhop {

std::shared_ptr<const Effect> make_damper_asymmetry(const EffectOptions&) {
  return effect_family("damper_asymmetry",
                       [](const Plant& plant, const Operation&, std::vector<EffectCandidate>& list) {
                         for (std::size_t e = 0; e < plant.elements.size(); ++e) {
                           const double damping = viscous_damping(plant.elements[e]);
                           if (damping <= 0) continue;
                           list.push_back(with_law(plant, e, "damper_asymmetry", "two slopes", "asymmetric_damper",
                                                   {damping, 0.1}, {{"asymmetry", 0.1}}));
                           list.back().either_sign = true;
                         }
                       });
}

}  // namespace wheelhop
