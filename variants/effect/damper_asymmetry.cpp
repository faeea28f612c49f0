#include "variants/effect/effects.hpp"

namespace wheelhop {

std::shared_ptr<const Effect> make_damper_asymmetry(const EffectOptions&) {
  return effect_family(
      "damper_asymmetry", [](const Plant& plant, const Operation& operation, std::vector<EffectCandidate>& list) {
        for (std::size_t e = 0; e < plant.elements.size(); ++e) {
          const double damping = viscous_damping(plant.elements[e]), rate = operation.elements[e].rate_rms_m_per_s;
          if (damping <= 0) continue;
          list.push_back(with_law(plant, e, "damper_asymmetry", "two slopes", "asymmetric_damper", {damping, 0.1},
                                  {{"asymmetry", 0.1}}));
          list.back().either_sign = true;
          if (!(rate > 0)) continue;
          // Valves that open each way: from the usual speed on, or from twice that.
          for (const double knee : {rate, 2 * rate}) {
            list.push_back(with_law(plant, e, "damper_asymmetry", "two slopes each way", "asymmetric_damper",
                                    {damping, 0.1, knee, 0.6, 0.6},
                                    {{"asymmetry", 0.1},
                                     {"knee_velocity_m_per_s", third(knee)},
                                     {"rebound_ratio", 0.2},
                                     {"jounce_ratio", 0.2}}));
            list.back().either_sign = true;
            list.back().refines = "two slopes";
            list.back().finer_by = 3;
          }
        }
      });
}

}  // namespace wheelhop
