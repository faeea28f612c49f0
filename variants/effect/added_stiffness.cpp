#include "variants/effect/effects.hpp"

namespace wheelhop {

// A spring that the plant file does not know, beside a damper that was delivered without one: the gas of a monotube
// damper, a bellows, a hose.
std::shared_ptr<const Effect> make_added_stiffness(const EffectOptions&) {
  return effect_family(
      "added_stiffness", [](const Plant& plant, const Operation& operation, std::vector<EffectCandidate>& list) {
        for (std::size_t e = 0; e < plant.elements.size(); ++e) {
          const ElementOperation& own = operation.elements[e];
          if (stiffness_at_rest(plant.elements[e]) > 0 || !(own.force_rms_n > 0 && own.travel_rms_m > 0)) continue;
          const double stiffness = 0.1 * own.force_rms_n / own.travel_rms_m;  // a tenth of the forces at work there
          list.push_back(with_law(plant, e, "added_stiffness", "linear", "linear_spring", {stiffness},
                                  {{"stiffness_n_per_m", third(stiffness)}}));
        }
      });
}

}  // namespace wheelhop
