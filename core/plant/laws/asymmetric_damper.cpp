#include <cmath>

#include "core/plant/laws.hpp"

namespace wheelhop {

// Beside a viscous damper of the same damping the two are d v (1 + a sgn v), passive for |a| <= 1.
LawKind asymmetric_damper() {
  LawKind kind;
  kind.name = "asymmetric_damper";
  kind.equation = "F = a d |v|, beside a viscous damper d";
  kind.source = "rebound and jounce valves of a shock absorber";
  kind.parameters = {{.name = "damping_ns_per_m",
                      .unit = "Ns/m",
                      .meaning = "damping d of the damper that is corrected",
                      .range = {.low = 0},
                      .typical = 1500},
                     {.name = "asymmetry",
                      .unit = "-",
                      .meaning = "a: growing travel is damped by d (1 + a), shrinking by d (1 - a); 0.2 to 0.5",
                      .range = {.low = -1, .high = 1},
                      .typical = 0.3}};
  kind.force = [](std::span<const double> p, double, double v, double& f) {
    f = p[1] * p[0] * std::abs(v);
    return true;
  };
  kind.slopes = [](std::span<const double> p, double, double v, double& df_dx, double& df_dv) {
    df_dx = 0;
    df_dv = v == 0 ? 0 : std::copysign(p[1] * p[0], p[1] * v);
    return true;
  };
  kind.dissipation = [](std::span<const double> p, double, double v) { return p[1] * p[0] * std::abs(v) * v; };
  kind.is_correction = true;
  return kind;
}

}  // namespace wheelhop
