#include "variants/effect/effects.hpp"

namespace wheelhop {

// Top mount, oil and gas put a spring of 200 to 1000 N/mm behind a damper; of a tyre it is the damping that is missing.
std::shared_ptr<const Effect> make_series_compliance(const EffectOptions&) {
  return effect_family(
      "series_compliance", [](const Plant& plant, const Operation&, std::vector<EffectCandidate>& list) {
        for (std::size_t e = 0; e < plant.elements.size(); ++e) {
          const double stiffness = 0.5 * stiffness_at_rest(plant.elements[e]);
          if (at_drive(plant, plant.elements[e]) || !(stiffness > 0)) continue;
          for (const double relaxation_s : {0.002, 0.01, 0.05})
            list.push_back(
                with_law(plant, e, "series_compliance", "Maxwell branch", "maxwell_branch", {stiffness, relaxation_s},
                         {{"series_stiffness_n_per_m", third(stiffness)}, {"relaxation_s", third(relaxation_s)}}));
        }
      });
}

}  // namespace wheelhop
