#include <limits>
#include "variants/effect/effects.hpp"

namespace wheelhop {

std::shared_ptr<const Effect> make_bump_stop(const EffectOptions&) {
  return effect_family("bump_stop", [](const Plant& plant, const Operation& operation,
                                       std::vector<EffectCandidate>& list) {
    for (std::size_t e = 0; e < plant.elements.size(); ++e) {
      const double stiffness = stiffness_at_rest(plant.elements[e]);
      if (at_drive(plant, plant.elements[e]) || stiffness <= 0) continue;
      constexpr double none = std::numeric_limits<double>::infinity();
      // Two gaps a side: a stop acts nowhere but beyond its gap, so no fit finds a gap it does not start near.
      for (const double share : {0.45, 0.75}) {
        const double shrinking = -share * operation.elements[e].travel_low_m;
        const double growing = share * operation.elements[e].travel_high_m;
        if (shrinking > 0) {
          list.push_back(with_law(plant, e, "bump_stop", "shrinking travel", "bump_stop",
                                  {shrinking, none, stiffness, 2},
                                  {{"compression_gap_m", 0.1 * shrinking}, {"stiffness_n_per_m", third(stiffness)}}));
          list.back().proportional = false;
          typically(list.back(), "compression_gap_m", share < 0.6 ? 0.02 : 0.035);
          typically(list.back(), "stiffness_n_per_m", 5e4);
        }
        if (growing > 0) {
          list.push_back(with_law(plant, e, "bump_stop", "growing travel", "bump_stop", {none, growing, stiffness, 2},
                                  {{"extension_gap_m", 0.1 * growing}, {"stiffness_n_per_m", third(stiffness)}}));
          list.back().proportional = false;
          typically(list.back(), "extension_gap_m", share < 0.6 ? 0.02 : 0.035);
          typically(list.back(), "stiffness_n_per_m", 5e4);
        }
      }
    }
  });
}

}  // namespace wheelhop
