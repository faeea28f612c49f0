#include <limits>

#include "variants/effect/effects.hpp"

namespace wheelhop {

std::shared_ptr<const Effect> make_bump_stop(const EffectOptions&) {
  return effect_family(
      "bump_stop", [](const Plant& plant, const Operation& operation, std::vector<EffectCandidate>& list) {
        for (std::size_t e = 0; e < plant.elements.size(); ++e) {
          const double stiffness = stiffness_at_rest(plant.elements[e]);
          if (at_drive(plant, plant.elements[e]) || stiffness <= 0) continue;
          constexpr double none = std::numeric_limits<double>::infinity();
          const ElementOperation& own = operation.elements[e];
          const auto stop = [&](const std::string& form, double share, double below, double above) {
            std::vector<std::pair<std::string, double>> moved;
            if (below < none) moved.push_back({"compression_gap_m", 0.1 * below});
            if (above < none) moved.push_back({"extension_gap_m", 0.1 * above});
            const auto gaps = moved;
            moved.push_back({"stiffness_n_per_m", third(stiffness)});
            list.push_back(with_law(plant, e, "bump_stop", form, "bump_stop", {below, above, stiffness, 2}, moved));
            EffectCandidate& candidate = list.back();
            candidate.proportional = false;
            typically(candidate, "stiffness_n_per_m", 5e4);
            for (const auto& [gap, scale] : gaps) {
              typically(candidate, gap, share < 0.6 ? 0.02 : 0.035);
              // Met by the peaks of the motion; what acts within the usual travel is a spring's own bend.
              plausibly(candidate, gap, 0.9 * own.travel_rms_m, 4 * own.travel_rms_m);
            }
          };
          // Two gaps a side: a stop acts nowhere but beyond its gap, so no fit finds a gap it does not start near.
          for (const double share : {0.45, 0.75}) {
            const double shrinking = -share * own.travel_low_m, growing = share * own.travel_high_m;
            if (shrinking > 0) stop("shrinking travel", share, shrinking, none);
            if (growing > 0) stop("growing travel", share, none, growing);
            if (shrinking > 0 && growing > 0) stop("both sides", share, shrinking, growing);
          }
        }
      });
}

}  // namespace wheelhop
