#include "variants/effect/effects.hpp"

namespace wheelhop {

// Top mount, oil and gas put a spring of 200 to 1000 N/mm behind a damper, which relaxes in 1 to 10 ms, beside the
// plant's own or behind it. What takes a tenth of a second creeps or belongs to another body.
std::shared_ptr<const Effect> make_series_compliance(const EffectOptions&) {
  return effect_family(
      "series_compliance", [](const Plant& plant, const Operation&, std::vector<EffectCandidate>& list) {
        for (std::size_t e = 0; e < plant.elements.size(); ++e) {
          const double stiffness = 0.5 * stiffness_at_rest(plant.elements[e]);
          if (is_tyre(plant, plant.elements[e]) || !(stiffness > 0)) continue;
          for (const double relaxation_s : {0.005, 0.05}) {
            list.push_back(
                with_law(plant, e, "series_compliance", "Maxwell branch", "maxwell_branch", {stiffness, relaxation_s},
                         {{"series_stiffness_n_per_m", third(stiffness)}, {"relaxation_s", third(relaxation_s)}}));
            defined_by(list.back(), "relaxation_s", 0.0005, 0.025);
          }
          const double damping = viscous_damping(plant.elements[e]);
          if (!(damping > 0)) continue;
          list.push_back(with_law(plant, e, "series_compliance", "mount behind the damper", "damper_mount",
                                  {damping, 0.002}, {{"relaxation_s", 0.0007}}));
          list.back().proportional = false;  // the shorter the time, the stiffer the equation
          defined_by(list.back(), "relaxation_s", 0.0005, 0.025);
        }
      });
}

}  // namespace wheelhop
