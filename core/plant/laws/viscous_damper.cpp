#include "core/plant/laws.hpp"

namespace wheelhop {

LawKind viscous_damper() {
  LawKind kind;
  kind.name = "viscous_damper";
  kind.equation = "F = d v";
  kind.source = "linear viscous damping";
  kind.parameters = {{.name = "damping_ns_per_m", .unit = "Ns/m", .meaning = "damping d", .range = {.low = 0}}};
  kind.force = [](std::span<const double> p, double, double v, double& f) {
    f = p[0] * v;
    return true;
  };
  kind.slopes = [](std::span<const double> p, double, double, double& df_dx, double& df_dv) {
    df_dx = 0;
    df_dv = p[0];
    return true;
  };
  kind.dissipation = [](std::span<const double> p, double, double v) { return p[0] * v * v; };
  kind.is_linear = true;
  return kind;
}

}  // namespace wheelhop
