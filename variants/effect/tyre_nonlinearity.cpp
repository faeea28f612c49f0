#include "variants/effect/effects.hpp"

namespace wheelhop {

std::shared_ptr<const Effect> make_tyre_nonlinearity(const EffectOptions&) {
  return effect_family("tyre_nonlinearity", [](const Plant& plant, std::vector<EffectCandidate>& list) {
    for (std::size_t e = 0; e < plant.elements.size(); ++e) {
      if (!at_drive(plant, plant.elements[e]) || stiffness_at_rest(plant.elements[e]) <= 0) continue;
      // Five percent of the stiffness at 10 mm.
      const double quadratic = 0.05 * stiffness_at_rest(plant.elements[e]) / 0.01, cubic = quadratic / 0.01;
      list.push_back(with_law(plant, e, "tyre_nonlinearity", "polynomial", "polynomial_spring", {0, quadratic, cubic},
                              {{"coefficients_2", quadratic}, {"coefficients_3", cubic}}));
      list.back().either_sign = true;
    }
  });
}

}  // namespace wheelhop
