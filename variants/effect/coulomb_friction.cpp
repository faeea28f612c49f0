#include "variants/effect/effects.hpp"

namespace wheelhop {

// A strut slides with 20 to 100 N, with side load 150 N; on another bench, with a share of the forces at work there. A
// mass slides on its guide with a share of the force that accelerates it.
std::shared_ptr<const Effect> make_coulomb_friction(const EffectOptions&) {
  return effect_family(
      "coulomb_friction", [](const Plant& plant, const Operation& operation, std::vector<EffectCandidate>& list) {
        for (const LawPlace& place : law_places(plant, operation)) {
          const ElementOperation& own = place.operation;
          const double force = 0.1 * own.force_rms_n, speed = 0.03 * own.rate_rms_m_per_s;
          const double slow = 0.2 * own.rate_rms_m_per_s;  // where a Stribeck decay begins to be seen
          if (!(force > 0 && speed > 0)) continue;
          list.push_back(with_law(plant, place, "coulomb_friction", "smoothed sign", "coulomb_friction",
                                  {force, 0, 10 * speed, speed},
                                  {{"force_n", third(force)}, {"velocity_m_per_s", third(speed)}}));
          smoothed_at_first(list.back());
          plausibly(list.back(), "velocity_m_per_s", 1e-3 * own.rate_rms_m_per_s, 0.2 * own.rate_rms_m_per_s);
          // Bent only at rates that usually occur, the same law is a damper that ends at a force.
          if (!place.guide() && has_damper(plant.elements[place.element])) {
            also_called(list.back(), "damper_nonlinearity", "saturating");
            plausibly(list.back(), "velocity_m_per_s", 0.2 * own.rate_rms_m_per_s, 2 * own.rate_rms_m_per_s);
          }
          if (!place.guide()) {
            typically(list.back(), "force_n", 40);
            typically(list.back(), "velocity_m_per_s", 0.005);
          }
          // Sliding that a stiff elastic travel of some percent of the whole precedes (Dahl 1968).
          const double yield = 0.02 * own.travel_rms_m;
          list.push_back(with_yielding(plant, place, "coulomb_friction", force, yield));
          if (!place.guide()) {
            typically(list.back(), "force_n", 40);
            typically(list.back(), "yield_travel_m", 1e-4);
          }
          // What takes more to break away than to slide on.
          list.push_back(with_law(plant, place, "coulomb_friction", "presliding, Stribeck", "bouc_wen",
                                  {force, yield, 1, 0.5, 0, 0.3, slow},
                                  {{"force_n", third(force)},
                                   {"yield_travel_m", third(yield)},
                                   {"stribeck_ratio", 0.1},
                                   {"stribeck_velocity_m_per_s", third(slow)}}));
          followed_by_steps(list.back(), own);
          plausibly(list.back(), "yield_travel_m", kLeastPresliding, kMostPresliding);
          list.back().refines = "presliding";
          list.back().finer_by = 2;
        }
      });
}

}  // namespace wheelhop
