#include "variants/effect/effects.hpp"

#include <limits>

namespace wheelhop {

std::shared_ptr<const Effect> make_bump_stop(const EffectOptions&) {
  return effect_family("bump_stop", [](const Plant& plant, std::vector<EffectCandidate>& list) {
    for (std::size_t e = 0; e < plant.elements.size(); ++e) {
      if (at_drive(plant, plant.elements[e])) continue;
      constexpr double none = std::numeric_limits<double>::infinity();
      // Two gaps a side: a stop acts nowhere but beyond its gap, so no fit finds a gap it does not start near.
      for (const double gap_m : {0.02, 0.035}) {
        list.push_back(with_law(plant, e, "bump_stop", "shrinking travel", "bump_stop", {gap_m, none, 5e4, 2},
                                {{"compression_gap_m", 0.005}, {"stiffness_n_per_m", 2e4}}));
        list.back().proportional = false;
        list.push_back(with_law(plant, e, "bump_stop", "growing travel", "bump_stop", {none, gap_m, 5e4, 2},
                                {{"extension_gap_m", 0.005}, {"stiffness_n_per_m", 2e4}}));
        list.back().proportional = false;
      }
    }
  });
}

}  // namespace wheelhop
