#include "variants/effect/effects.hpp"

namespace wheelhop {

std::shared_ptr<const Effect> make_hysteresis(const EffectOptions&) {
  return effect_family("hysteresis", [](const Plant& plant, std::vector<EffectCandidate>& list) {
    for (std::size_t e = 0; e < plant.elements.size(); ++e) {
      // Two yield travels: bushings creep over millimetres, a strut breaks away within tenths.
      for (const double yield_m : {0.0005, 0.002})
        list.push_back(with_law(plant, e, "hysteresis", "Bouc-Wen", "bouc_wen", {60, yield_m, 1, 0.5},
                                {{"force_n", 20}, {"yield_travel_m", 0.3 * yield_m}}));
    }
  });
}

}  // namespace wheelhop
