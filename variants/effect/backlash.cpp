#include "variants/effect/effects.hpp"

namespace wheelhop {

std::shared_ptr<const Effect> make_backlash(const EffectOptions&) {
  return effect_family(
      "backlash", [](const Plant& plant, const Operation& operation, std::vector<EffectCandidate>& list) {
        for (std::size_t e = 0; e < plant.elements.size(); ++e) {
          if (stiffness_at_rest(plant.elements[e]) <= 0) continue;
          for (const double share : {0.02, 0.1}) {
            const double gap = share * operation.elements[e].travel_rms_m;
            if (!(gap > 0)) continue;
            list.push_back(with_law(plant, e, "backlash", "play", "backlash", {gap}, {{"gap_m", third(gap)}}));
            list.back().proportional = false;
            typically(list.back(), "gap_m", 0.0002);
          }
        }
      });
}

}  // namespace wheelhop
