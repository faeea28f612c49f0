#include "variants/effect/effects.hpp"

namespace wheelhop {

std::shared_ptr<const Effect> make_tyre_liftoff(const EffectOptions&) {
  return effect_family(
      "tyre_liftoff", [](const Plant& plant, const Operation& operation, std::vector<EffectCandidate>& list) {
        for (std::size_t e = 0; e < plant.elements.size(); ++e) {
          if (!is_tyre(plant, plant.elements[e])) continue;
          for (const double share : {0.5, 0.8}) {  // of the largest pull: a heavier load never lifts off
            const double load = share * operation.elements[e].force_high_n;
            if (!(load > 0)) continue;
            list.push_back(
                with_law(plant, e, "tyre_liftoff", "contact", "liftoff", {load}, {{"static_load_n", 0.1 * load}}));
            list.back().proportional = false;
            typically(list.back(), "static_load_n", 3500);
          }
        }
      });
}

}  // namespace wheelhop
