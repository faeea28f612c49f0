#include "variants/effect/effects.hpp"

namespace wheelhop {

std::shared_ptr<const Effect> make_hysteresis(const EffectOptions&) {
  return effect_family(
      "hysteresis", [](const Plant& plant, const Operation& operation, std::vector<EffectCandidate>& list) {
        for (const LawPlace& place : law_places(plant, operation)) {
          const ElementOperation& own = place.operation;
          const double force = 0.1 * own.force_rms_n;
          if (!(force > 0 && own.travel_rms_m > 0)) continue;
          // Two yield travels: a share of the travel, and one the element hardly leaves.
          for (const double share : {0.1, 0.5}) {
            const double yield = share * own.travel_rms_m;
            list.push_back(with_yielding(plant, place, "hysteresis", force, yield));
            if (place.guide()) continue;
            typically(list.back(), "force_n", 60);
            typically(list.back(), "yield_travel_m", share < 0.3 ? 0.0005 : 0.002);
          }
          // Loading that hardly yields, or stiffens, under unloading that is steeper: joints, wire ropes, elastomers. A
          // fit may start at a small share of the element's force, and at a large one.
          const double yield = 0.5 * own.travel_rms_m;
          for (const double share : {1.0, 3.0}) {
            list.push_back(with_law(
                plant, place, "hysteresis", "Bouc-Wen, stiffening", "bouc_wen", {share * force, yield, 1, 0.5, 1},
                {{"force_n", third(share * force)}, {"yield_travel_m", third(yield)}, {"stiffening", 0.3}}));
            // Nothing bounds what stiffens: a travel far beyond the yield travel is left to the coarser form.
            list.back().parameters[1].least = 0.1 * own.travel_rms_m;
            plausibly(list.back(), "yield_travel_m", kLeastYield, kMostYield);
            list.back().refines = "Bouc-Wen";
            list.back().finer_by = 1;
          }
        }
      });
}

}  // namespace wheelhop
