#include "variants/effect/effects.hpp"

namespace wheelhop {

std::shared_ptr<const Effect> make_tyre_damping(const EffectOptions&) {
  return effect_family(
      "tyre_damping", [](const Plant& plant, const Operation& operation, std::vector<EffectCandidate>& list) {
        for (std::size_t e = 0; e < plant.elements.size(); ++e) {
          const Element& tyre = plant.elements[e];
          if (!is_tyre(plant, tyre)) continue;
          list.push_back(
              with_law(plant, e, "tyre_damping", "viscous", "viscous_damper", {100}, {{"damping_ns_per_m", 100}}));
          // Behind a spring, as rubber is: a step of the road meets no infinite force.
          const double series = 0.3 * stiffness_at_rest(tyre);
          if (series > 0)
            list.push_back(with_law(plant, e, "tyre_damping", "viscoelastic", "maxwell_branch", {series, 0.002},
                                    {{"series_stiffness_n_per_m", third(series)}, {"relaxation_s", 0.0007}}));
          // Against the ground instead of the moving patch: what is left where the velocity of the drive does not act.
          const std::string& mass = plant.node(tyre.to) < plant.mass_count() ? tyre.to : tyre.from;
          for (const LawPlace& place : law_places(plant, operation)) {
            const bool damped = place.element < plant.elements.size() && has_damper(plant.elements[place.element]);
            if (place.mass != mass || damped) continue;
            list.push_back(with_law(plant, place, "tyre_damping", "to the ground", "viscous_damper", {100},
                                    {{"damping_ns_per_m", 100}}));
            list.back().location = part_place(tyre.name);
          }
        }
      });
}

}  // namespace wheelhop
