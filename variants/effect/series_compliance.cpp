#include "variants/effect/effects.hpp"

namespace wheelhop {

std::shared_ptr<const Effect> make_series_compliance(const EffectOptions&) {
  return effect_family("series_compliance", [](const Plant& plant, std::vector<EffectCandidate>& list) {
    for (std::size_t e = 0; e < plant.elements.size(); ++e) {
      for (const double relaxation_s : {0.002, 0.01})
        list.push_back(with_law(plant, e, "series_compliance", "Maxwell branch", "maxwell_branch", {4e4, relaxation_s},
                                {{"series_stiffness_n_per_m", 1e4}, {"relaxation_s", 0.3 * relaxation_s}}));
    }
  });
}

}  // namespace wheelhop
