#include "variants/effect/effects.hpp"

namespace wheelhop {

std::shared_ptr<const Effect> make_cavitation(const EffectOptions&) {
  return effect_family(
      "cavitation", [](const Plant& plant, const Operation& operation, std::vector<EffectCandidate>& list) {
        for (std::size_t e = 0; e < plant.elements.size(); ++e) {
          const double damping = viscous_damping(plant.elements[e]);
          if (damping <= 0) continue;
          for (const double side : {1.0, -1.0})
            for (const double share : {0.008, 0.15}) {
              const double travel = share * operation.elements[e].travel_rms_m;
              if (!(travel > 0)) continue;
              list.push_back(with_law(plant, e, "cavitation", side > 0 ? "rebound" : "jounce", "cavitating_damper",
                                      {damping, travel, side, 4}, {{"dead_travel_m", third(travel)}, {"onset", 1.5}}));
              list.back().proportional = false;  // the shorter the travel, the stiffer the equation
              typically(list.back(), "dead_travel_m", 0.002);
            }
        }
      });
}

}  // namespace wheelhop
