#include "variants/effect/effects.hpp"

namespace wheelhop {

// A spring that the plant file does not know: beside a damper that was delivered without one (the gas of a monotube
// damper, a bellows), or between a mass and the ground (a hose, a cable, a tether). At the guide of a wheel it is the
// tyre's own.
std::shared_ptr<const Effect> make_added_stiffness(const EffectOptions&) {
  return effect_family("added_stiffness", [](const Plant& plant, const Operation& operation,
                                             std::vector<EffectCandidate>& list) {
    for (const LawPlace& place : law_places(plant, operation)) {
      const ElementOperation& own = place.operation;
      const bool known = place.element < plant.elements.size() && stiffness_at_rest(plant.elements[place.element]) > 0;
      if (known || at_tyre(plant, place) || !(own.force_rms_n > 0 && own.travel_rms_m > 0)) continue;
      const double stiffness = 0.1 * own.force_rms_n / own.travel_rms_m;  // a tenth of the forces at work there
      list.push_back(with_law(plant, place, "added_stiffness", "linear", "linear_spring", {stiffness},
                              {{"stiffness_n_per_m", third(stiffness)}}));
    }
  });
}

}  // namespace wheelhop
