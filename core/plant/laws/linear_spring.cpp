#include "core/plant/laws.hpp"

namespace wheelhop {

LawKind linear_spring() {
  LawKind kind;
  kind.name = "linear_spring";
  kind.equation = "F = k x";
  kind.source = "Hooke's law";
  kind.parameters = {{.name = "stiffness_n_per_m", .unit = "N/m", .meaning = "stiffness k", .range = {.low = 0}}};
  kind.force = [](std::span<const double> p, double x, double, double& f) {
    f = p[0] * x;
    return true;
  };
  kind.slopes = [](std::span<const double> p, double, double, double& df_dx, double& df_dv) {
    df_dx = p[0];
    df_dv = 0;
    return true;
  };
  kind.energy = [](std::span<const double> p, double x) { return 0.5 * p[0] * x * x; };
  kind.is_linear = true;
  return kind;
}

}  // namespace wheelhop
