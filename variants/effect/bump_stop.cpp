#include <limits>

#include "variants/effect/effects.hpp"

namespace wheelhop {

// An element ends at stops of its own, a guided mass at the ends of its rail.
std::shared_ptr<const Effect> make_bump_stop(const EffectOptions&) {
  return effect_family(
      "bump_stop", [](const Plant& plant, const Operation& operation, std::vector<EffectCandidate>& list) {
        for (const LawPlace& place : law_places(plant, operation)) {
          const ElementOperation& own = place.operation;
          const bool guide = place.guide();
          // About as stiff as what holds the mass or the ends of the element by now.
          const double stiffness = !guide                 ? stiffness_at_rest(plant.elements[place.element])
                                   : own.travel_rms_m > 0 ? own.force_rms_n / own.travel_rms_m
                                                          : 0;
          if ((!guide && at_tyre(plant, place)) || !(stiffness > 0)) continue;
          constexpr double none = std::numeric_limits<double>::infinity();
          const auto stop = [&](const std::string& form, double share, double below, double above) {
            std::vector<std::pair<std::string, double>> moved;
            if (below < none) moved.push_back({"compression_gap_m", 0.1 * below});
            if (above < none) moved.push_back({"extension_gap_m", 0.1 * above});
            const auto gaps = moved;
            moved.push_back({"stiffness_n_per_m", third(stiffness)});
            list.push_back(with_law(plant, place, "bump_stop", form, "bump_stop", {below, above, stiffness, 2}, moved));
            EffectCandidate& candidate = list.back();
            candidate.proportional = false;
            if (!guide) typically(candidate, "stiffness_n_per_m", 5e4);
            for (const auto& [gap, scale] : gaps) {
              if (!guide) typically(candidate, gap, share < 0.6 ? 0.02 : 0.035);
              // Met by the peaks of the motion; what acts within the usual travel is a spring's own bend.
              plausibly(candidate, gap, 0.9 * own.travel_rms_m, 4 * own.travel_rms_m);
            }
          };
          // Two gaps a side: a stop acts nowhere but beyond its gap, so no fit finds a gap it does not start near. One
          // at the end of a rail, of which a plant has many and few are reached.
          for (const double share : guide ? std::vector{0.6} : std::vector{0.45, 0.75}) {
            const double shrinking = -share * own.travel_low_m, growing = share * own.travel_high_m;
            if (shrinking > 0) stop("shrinking travel", share, shrinking, none);
            if (growing > 0) stop("growing travel", share, none, growing);
            if (shrinking > 0 && growing > 0) stop("both sides", share, shrinking, growing);
          }
        }
      });
}

}  // namespace wheelhop
