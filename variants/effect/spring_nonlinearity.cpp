#include <limits>
#include "variants/effect/effects.hpp"

namespace wheelhop {
namespace {

// A judgement: a knee nearer to rest than this share of where the nearest usually are may as well be at rest.
constexpr double kAtRest = 0.1;

}  // namespace

std::shared_ptr<const Effect> make_spring_nonlinearity(const EffectOptions&) {
  return effect_family("spring_nonlinearity", [](const Plant& plant, const Operation& operation,
                                                 std::vector<EffectCandidate>& list) {
    for (std::size_t e = 0; e < plant.elements.size(); ++e) {
      const ElementOperation& own = operation.elements[e];
      const double reach = 2 * own.travel_rms_m, stiffness = stiffness_at_rest(plant.elements[e]);
      if (is_tyre(plant, plant.elements[e]) || stiffness <= 0 || !(reach > 0)) continue;
      const double quadratic = 0.05 * stiffness / reach, cubic = quadratic / reach;
      list.push_back(with_law(plant, e, "spring_nonlinearity", "polynomial", "polynomial_spring", {0, quadratic, cubic},
                              {{"coefficients_2", quadratic}, {"coefficients_3", cubic}}));
      list.back().either_sign = true;
      for (const double exponent : {0.5, 2.5}) {  // softer or harder, without the pole or the fall of a polynomial
        list.push_back(with_law(plant, e, "spring_nonlinearity", "", "bending_spring", {stiffness, 2 * reach, exponent},
                                {{"knee_travel_m", third(2 * reach)}, {"exponent", 0.3}}));
        bends(list.back(), "exponent", 1, "softening", "hardening");
        list.back().proportional = false;
      }
      // A characteristic of straight pieces: another slope beyond a knee, on one side or on both.
      if (!(own.travel_high_m > 0 && own.travel_low_m < 0)) continue;
      constexpr double none = std::numeric_limits<double>::infinity();
      const double growing = 0.35 * own.travel_high_m, shrinking = -0.35 * own.travel_low_m, extra = 0.2 * stiffness;
      const auto knee = [&](const std::string& form, double below, double above,
                            const std::vector<std::pair<std::string, double>>& moved) {
        list.push_back(with_law(plant, e, "spring_nonlinearity", form, "bump_stop", {below, above, extra, 1}, moved));
        // Within the usual travel it is another slope of the same spring. What the peaks alone meet, and hard, is a
        // stop.
        EffectCandidate& candidate = list.back();
        const auto sized = [&](double nearest, double farthest, double softest, double hardest) {
          plausibly(candidate, "stiffness_n_per_m", softest, hardest);
          for (std::size_t k = 1; k < moved.size(); ++k) {
            plausibly(candidate, moved[k].first, nearest * own.travel_rms_m, farthest * own.travel_rms_m);
            candidate.labels.back().plausible.back().least = kAtRest * nearest * own.travel_rms_m;
          }
        };
        sized(0.15, 1.3, 0.05 * stiffness, 3 * stiffness);
        also_called(candidate, "bump_stop", "linear, " + form);
        sized(0.9, 4, stiffness, 100 * stiffness);
      };
      knee("knee in growing travel", none, growing, {{"stiffness_n_per_m", extra}, {"extension_gap_m", 0.2 * growing}});
      knee("knee in shrinking travel", shrinking, none,
           {{"stiffness_n_per_m", extra}, {"compression_gap_m", 0.2 * shrinking}});
      knee("knees on both sides", shrinking, growing,
           {{"stiffness_n_per_m", extra}, {"extension_gap_m", 0.2 * growing}, {"compression_gap_m", 0.2 * shrinking}});
    }
  });
}

}  // namespace wheelhop
