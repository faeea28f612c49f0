#include "variants/effect/effects.hpp"

namespace wheelhop {

// A strut slides with 20 to 100 N, with side load 150 N.
std::shared_ptr<const Effect> make_coulomb_friction(const EffectOptions&) {
  return effect_family("coulomb_friction", [](const Plant& plant, std::vector<EffectCandidate>& list) {
    for (std::size_t e = 0; e < plant.elements.size(); ++e) {
      list.push_back(with_law(plant, e, "coulomb_friction", "smoothed sign", "coulomb_friction", {40, 0, 0.05, 0.005},
                              {{"force_n", 15}, {"velocity_m_per_s", 0.002}}));
      // Sliding that a stiff elastic travel of a tenth of a millimetre precedes (Dahl 1968).
      list.push_back(with_law(plant, e, "coulomb_friction", "presliding", "bouc_wen", {40, 1e-4, 1, 0.5},
                              {{"force_n", 15}, {"yield_travel_m", 3e-5}}));
    }
  });
}

}  // namespace wheelhop
