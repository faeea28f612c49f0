#include "variants/effect/effects.hpp"

#include <limits>

namespace wheelhop {

std::shared_ptr<const Effect> make_spring_nonlinearity(const EffectOptions&) {
  return effect_family(
      "spring_nonlinearity", [](const Plant& plant, const Operation& operation, std::vector<EffectCandidate>& list) {
        for (std::size_t e = 0; e < plant.elements.size(); ++e) {
          const double reach = 2 * operation.elements[e].travel_rms_m, stiffness = stiffness_at_rest(plant.elements[e]);
          if (at_drive(plant, plant.elements[e]) || stiffness <= 0 || !(reach > 0)) continue;
          const double quadratic = 0.05 * stiffness / reach, cubic = quadratic / reach;
          list.push_back(with_law(plant, e, "spring_nonlinearity", "polynomial", "polynomial_spring",
                                  {0, quadratic, cubic}, {{"coefficients_2", quadratic}, {"coefficients_3", cubic}}));
          list.back().either_sign = true;
        }
      });
}

}  // namespace wheelhop
