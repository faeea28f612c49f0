#include "variants/effect/effects.hpp"

namespace wheelhop {

std::shared_ptr<const Effect> make_tyre_nonlinearity(const EffectOptions&) {
  return effect_family(
      "tyre_nonlinearity", [](const Plant& plant, const Operation& operation, std::vector<EffectCandidate>& list) {
        for (std::size_t e = 0; e < plant.elements.size(); ++e) {
          const double reach = 2 * operation.elements[e].travel_rms_m, stiffness = stiffness_at_rest(plant.elements[e]);
          if (!is_tyre(plant, plant.elements[e]) || stiffness <= 0 || !(reach > 0)) continue;
          const double quadratic = 0.05 * stiffness / reach, cubic = quadratic / reach;
          // Both are fitted from a start with either alone: the screen sees one size, which the cubic would rule.
          const auto polynomial = [&](const std::vector<double>& start,
                                      const std::vector<std::pair<std::string, double>>& moved) {
            list.push_back(with_law(plant, e, "tyre_nonlinearity", "polynomial", "polynomial_spring", start, moved));
            list.back().either_sign = true;
          };
          polynomial({0, quadratic, 0}, {{"coefficients_2", quadratic}, {"coefficients_3", cubic}});
          polynomial({0, 0, cubic}, {{"coefficients_3", cubic}, {"coefficients_2", quadratic}});
        }
      });
}

}  // namespace wheelhop
