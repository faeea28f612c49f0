#include <algorithm>
#include "variants/effect/effects.hpp"

namespace wheelhop {

// Ride height: the spring works about another point of its characteristic than delivered.
std::shared_ptr<const Effect> make_static_offset(const EffectOptions&) {
  return effect_family(
      "static_offset", [](const Plant& plant, const Operation& operation, std::vector<EffectCandidate>& list) {
        for (std::size_t e = 0; e < plant.elements.size(); ++e) {
          const double offset = 0.3 * operation.elements[e].travel_rms_m;
          const auto curved = [](const Law& law) { return !law.kind->is_linear && law.states() == 0; };
          const std::vector<Law>& laws = plant.elements[e].laws;
          if (!(offset > 0) || std::none_of(laws.begin(), laws.end(), curved)) continue;
          list.push_back(
              with_law(plant, e, "static_offset", "rest position", "rest_offset", {offset}, {{"offset_m", offset}}));
          list.back().either_sign = true;
          typically(list.back(), "offset_m", 0.01);
        }
      });
}

}  // namespace wheelhop
