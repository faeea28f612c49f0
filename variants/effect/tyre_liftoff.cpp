#include "variants/effect/effects.hpp"

namespace wheelhop {

std::shared_ptr<const Effect> make_tyre_liftoff(const EffectOptions&) {
  return effect_family("tyre_liftoff", [](const Plant& plant, std::vector<EffectCandidate>& list) {
    for (std::size_t e = 0; e < plant.elements.size(); ++e) {
      if (!at_drive(plant, plant.elements[e])) continue;
      list.push_back(with_law(plant, e, "tyre_liftoff", "contact", "liftoff", {3500}, {{"static_load_n", 500}}));
      list.back().proportional = false;
    }
  });
}

}  // namespace wheelhop
