#include "core/plant/laws.hpp"

namespace wheelhop {
namespace {

enum { damping, square, linear };

double share(std::span<const double> p, double x) { return (p[linear] + p[square] * x) * x; }

}  // namespace

// Beside a viscous damper of the same damping the two are d v (1 + b_1 x + b_2 x^2).
LawKind position_dependent_damper() {
  LawKind kind;
  kind.name = "position_dependent_damper";
  kind.equation = "F = d (b_1 x + b_2 x^2) v, beside a viscous damper d";
  kind.source = "bypass grooves, motion ratio of the linkage";
  kind.parameters = {
      {.name = "damping_ns_per_m",
       .unit = "Ns/m",
       .meaning = "damping d of the damper that is corrected",
       .range = {.low = 0},
       .typical = 1500},
      {.name = "per_m2",
       .unit = "1/m^2",
       .meaning = "b_2; 5 to 30 % over a travel of 0.05 m is 20 to 120",
       .typical = 80},
      {.name = "per_m", .unit = "1/m", .meaning = "b_1, the change of the motion ratio; up to 4", .required = false}};
  kind.force = [](std::span<const double> p, double x, double v, double& f) {
    f = p[damping] * share(p, x) * v;
    return true;
  };
  kind.slopes = [](std::span<const double> p, double x, double v, double& df_dx, double& df_dv) {
    df_dx = p[damping] * (p[linear] + 2 * p[square] * x) * v;
    df_dv = p[damping] * share(p, x);
    return true;
  };
  kind.dissipation = [](std::span<const double> p, double x, double v) { return p[damping] * share(p, x) * v * v; };
  kind.is_correction = true;
  return kind;
}

}  // namespace wheelhop
