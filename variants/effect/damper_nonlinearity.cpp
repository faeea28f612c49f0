#include "variants/effect/effects.hpp"

namespace wheelhop {

std::shared_ptr<const Effect> make_damper_nonlinearity(const EffectOptions&) {
  return effect_family("damper_nonlinearity", [](const Plant& plant, std::vector<EffectCandidate>& list) {
    for (std::size_t e = 0; e < plant.elements.size(); ++e) {
      const double damping = viscous_damping(plant.elements[e]);
      if (damping <= 0) continue;
      list.push_back(with_law(plant, e, "damper_nonlinearity", "digressive", "digressive_damper", {damping, 0.2, 0.5},
                              {{"knee_velocity_m_per_s", 0.06}, {"exponent", 0.2}}));
      list.back().proportional = false;
      list.push_back(with_law(plant, e, "damper_nonlinearity", "progressive", "digressive_damper", {damping, 0.5, 1.5},
                              {{"knee_velocity_m_per_s", 0.15}, {"exponent", 0.2}}));
      list.back().proportional = false;
      list.push_back(with_law(plant, e, "damper_nonlinearity", "position dependent", "position_dependent_damper",
                              {damping, 40, 0.5}, {{"per_m2", 40}, {"per_m", 1}}));
      list.back().either_sign = true;
    }
  });
}

}  // namespace wheelhop
