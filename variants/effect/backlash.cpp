#include "variants/effect/effects.hpp"

namespace wheelhop {

std::shared_ptr<const Effect> make_backlash(const EffectOptions&) {
  return effect_family("backlash", [](const Plant& plant, std::vector<EffectCandidate>& list) {
    for (std::size_t e = 0; e < plant.elements.size(); ++e) {
      list.push_back(with_law(plant, e, "backlash", "play", "backlash", {0.0002}, {{"gap_m", 0.00007}}));
      list.back().proportional = false;
    }
  });
}

}  // namespace wheelhop
