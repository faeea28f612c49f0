#include "variants/effect/effects.hpp"

namespace wheelhop {
namespace {

/// Flow around a guided mass or through the gap of its guide, which no damper is there to bend. The drag goes with the
/// speed to the power 1.75 (turbulent along smooth walls, Blasius 1913) to 2 (orifice, bluff body).
void add_drag(const Plant& plant, const Operation& operation, std::vector<EffectCandidate>& list) {
  for (const LawPlace& place : law_places(plant, operation)) {
    const ElementOperation& own = place.operation;
    const bool known = place.element < plant.elements.size() && has_damper(plant.elements[place.element]);
    if (!place.guide() || known || at_tyre(plant, place)) continue;
    if (!(own.force_rms_n > 0 && own.rate_rms_m_per_s > 0)) continue;
    // A tenth of the forces at work at the usual speed, and no linear part but at a third of that.
    const double knee = third(own.rate_rms_m_per_s), damping = 0.1 * own.force_rms_n / own.rate_rms_m_per_s / 4;
    list.push_back(with_law(plant, place, "damper_nonlinearity", "drag", "power_law_damper", {damping, knee, 2},
                            {{"damping_ns_per_m", third(damping)}, {"exponent", 0.2}}));
    plausibly(list.back(), "exponent", 1.6, 2.2);
  }
}

}  // namespace

std::shared_ptr<const Effect> make_damper_nonlinearity(const EffectOptions&) {
  return effect_family("damper_nonlinearity", [](const Plant& plant, const Operation& operation,
                                                 std::vector<EffectCandidate>& list) {
    add_drag(plant, operation, list);
    for (std::size_t e = 0; e < plant.elements.size(); ++e) {
      const double damping = viscous_damping(plant.elements[e]);
      const ElementOperation& own = operation.elements[e];
      if (damping <= 0 || !(own.rate_rms_m_per_s > 0)) continue;
      const auto bending = [&](double knee, double exponent) {
        list.push_back(with_law(plant, e, "damper_nonlinearity", "", "digressive_damper", {damping, knee, exponent, 1},
                                {{"knee_velocity_m_per_s", third(knee)}, {"exponent", 0.2}}));
        bends(list.back(), "exponent", 1, "digressive", "progressive");
        list.back().proportional = false;
      };
      // Below the knee the damper is the viscous one, beyond it bends: from twice the usual speed or from the usual.
      for (const double share : {0.7, 2.0}) {
        const double knee = share * own.rate_rms_m_per_s;
        bending(knee, 0.5);
        typically(list.back(), "knee_velocity_m_per_s", 0.2);
      }
      const double knee = 2 * own.rate_rms_m_per_s;
      // A valve that opens: hardly anything below the knee.
      list.push_back(with_law(plant, e, "damper_nonlinearity", "blow-off", "digressive_damper",
                              {damping, 0.5 * knee, 0.3, 2},
                              {{"knee_velocity_m_per_s", third(0.5 * knee)}, {"exponent", 0.2}, {"sharpness", 0.5}}));
      list.back().proportional = false;
      typically(list.back(), "knee_velocity_m_per_s", 0.2);
      bending(knee, 1.5);
      typically(list.back(), "knee_velocity_m_per_s", 0.5);
      const double per_m = 0.1 / std::max(own.travel_rms_m, 1e-9), per_m2 = per_m / std::max(own.travel_rms_m, 1e-9);
      list.push_back(with_law(plant, e, "damper_nonlinearity", "position dependent", "position_dependent_damper",
                              {damping, per_m2, per_m}, {{"per_m2", third(per_m2)}, {"per_m", third(per_m)}}));
      list.back().either_sign = true;
    }
  });
}

}  // namespace wheelhop
