#include "variants/effect/effects.hpp"

namespace wheelhop {

// A damper that the plant file does not know: beside a spring that was delivered without one, or in the guide of a
// mass. That of a tyre, and of the guide of the wheel on it, is `tyre_damping`.
std::shared_ptr<const Effect> make_added_damping(const EffectOptions&) {
  return effect_family(
      "added_damping", [](const Plant& plant, const Operation& operation, std::vector<EffectCandidate>& list) {
        for (const LawPlace& place : law_places(plant, operation)) {
          const ElementOperation& own = place.operation;
          const bool known = place.element < plant.elements.size() && has_damper(plant.elements[place.element]);
          if (known || at_tyre(plant, place) || !(own.force_rms_n > 0 && own.rate_rms_m_per_s > 0)) continue;
          const double damping = 0.1 * own.force_rms_n / own.rate_rms_m_per_s;  // a tenth of the forces at work there
          list.push_back(with_law(plant, place, "added_damping", "viscous", "viscous_damper", {damping},
                                  {{"damping_ns_per_m", third(damping)}}));
        }
      });
}

}  // namespace wheelhop
