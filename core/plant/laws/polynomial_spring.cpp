#include "core/plant/laws.hpp"

namespace wheelhop {

LawKind polynomial_spring() {
  LawKind kind;
  kind.name = "polynomial_spring";
  kind.equation = "F = c_1 x + c_2 x^2 + c_3 x^3 + ...";
  kind.source = "Taylor expansion of a spring about its rest";
  kind.parameters = {{.name = "coefficients",
                      .unit = "N/m^k",
                      .meaning = "coefficients c_1, c_2, ... of x, x^2, ...",
                      .is_list = true}};
  kind.force = [](std::span<const double> p, double x, double, double& f) {
    f = 0;
    for (std::size_t k = p.size(); k-- > 0;) f = (f + p[k]) * x;
    return true;
  };
  kind.slopes = [](std::span<const double> p, double x, double, double& df_dx, double& df_dv) {
    df_dx = 0;
    for (std::size_t k = p.size(); k-- > 0;) df_dx = df_dx * x + static_cast<double>(k + 1) * p[k];
    df_dv = 0;
    return true;
  };
  kind.energy = [](std::span<const double> p, double x) {
    double sum = 0;
    for (std::size_t k = p.size(); k-- > 0;) sum = (sum + p[k] / static_cast<double>(k + 2)) * x;
    return sum * x;
  };
  return kind;
}

}  // namespace wheelhop
