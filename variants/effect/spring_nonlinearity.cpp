#include <limits>
#include "variants/effect/effects.hpp"

namespace wheelhop {

std::shared_ptr<const Effect> make_spring_nonlinearity(const EffectOptions&) {
  return effect_family("spring_nonlinearity", [](const Plant& plant, const Operation& operation,
                                                 std::vector<EffectCandidate>& list) {
    for (std::size_t e = 0; e < plant.elements.size(); ++e) {
      const ElementOperation& own = operation.elements[e];
      const double reach = 2 * own.travel_rms_m, stiffness = stiffness_at_rest(plant.elements[e]);
      if (at_drive(plant, plant.elements[e]) || stiffness <= 0 || !(reach > 0)) continue;
      const double quadratic = 0.05 * stiffness / reach, cubic = quadratic / reach;
      list.push_back(with_law(plant, e, "spring_nonlinearity", "polynomial", "polynomial_spring", {0, quadratic, cubic},
                              {{"coefficients_2", quadratic}, {"coefficients_3", cubic}}));
      list.back().either_sign = true;
      // A characteristic of straight pieces: another slope beyond a knee, on one side or on both.
      if (!(own.travel_high_m > 0 && own.travel_low_m < 0)) continue;
      constexpr double none = std::numeric_limits<double>::infinity();
      const double growing = 0.35 * own.travel_high_m, shrinking = -0.35 * own.travel_low_m, extra = 0.2 * stiffness;
      list.push_back(with_law(plant, e, "spring_nonlinearity", "knee in growing travel", "bump_stop",
                              {none, growing, extra, 1},
                              {{"stiffness_n_per_m", extra}, {"extension_gap_m", 0.2 * growing}}));
      list.push_back(with_law(plant, e, "spring_nonlinearity", "knee in shrinking travel", "bump_stop",
                              {shrinking, none, extra, 1},
                              {{"stiffness_n_per_m", extra}, {"compression_gap_m", 0.2 * shrinking}}));
      list.push_back(with_law(
          plant, e, "spring_nonlinearity", "knees on both sides", "bump_stop", {shrinking, growing, extra, 1},
          {{"stiffness_n_per_m", extra}, {"extension_gap_m", 0.2 * growing}, {"compression_gap_m", 0.2 * shrinking}}));
    }
  });
}

}  // namespace wheelhop
