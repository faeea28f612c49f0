#include <cmath>
#include <limits>

#include "core/plant/laws.hpp"

namespace wheelhop {
namespace {

enum { compression_gap, extension_gap, stiffness, exponent };

// Travel into the stop over which its stiffness is the secant, whatever the exponent.
constexpr double reference_m = 0.01;

// Signed travel into either stop. An absent stop has an infinite gap, which no travel reaches.
double depth(std::span<const double> p, double x) {
  if (x > p[extension_gap]) return x - p[extension_gap];
  if (x < -p[compression_gap]) return x + p[compression_gap];
  return 0;
}

}  // namespace

LawKind bump_stop() {
  LawKind kind;
  kind.name = "bump_stop";
  kind.equation = "F = k r sgn(s) (|s|/r)^n, s = travel into the stop, r = 0.01 m";
  kind.source = "elastomer or foam stop; k is the secant stiffness 0.01 m into it";
  kind.parameters = {{.name = "compression_gap_m",
                      .unit = "m",
                      .meaning = "travel -x at which the stop of shrinking travel is met; 0.02 to 0.06 m; absent: none",
                      .range = {.low = 0},
                      .required = false,
                      .fallback = std::numeric_limits<double>::infinity(),
                      .typical = 0.03},
                     {.name = "extension_gap_m",
                      .unit = "m",
                      .meaning = "travel x at which the stop of growing travel is met; 0.02 to 0.06 m; absent: none",
                      .range = {.low = 0},
                      .required = false,
                      .fallback = std::numeric_limits<double>::infinity(),
                      .typical = 0.04},
                     {.name = "stiffness_n_per_m",
                      .unit = "N/m",
                      .meaning = "secant stiffness k; 50,000 to 500,000 N/m",
                      .range = {.low = 0},
                      .typical = 1e5},
                     {.name = "exponent",
                      .unit = "-",
                      .meaning = "n: 1 for a linear stop, 2 to 3.5 for foam",
                      .range = {.low = 1, .high = 3.5},
                      .required = false,
                      .fallback = 2,
                      .typical = 2}};
  kind.force = [](std::span<const double> p, double x, double, double& f) {
    const double s = depth(p, x);
    f = s == 0 ? 0 : std::copysign(p[stiffness] * reference_m * std::pow(std::abs(s) / reference_m, p[exponent]), s);
    return true;
  };
  kind.slopes = [](std::span<const double> p, double x, double, double& df_dx, double& df_dv) {
    const double s = std::abs(depth(p, x));
    df_dx = s == 0 ? 0 : p[stiffness] * p[exponent] * std::pow(s / reference_m, p[exponent] - 1);
    df_dv = 0;
    return true;
  };
  kind.energy = [](std::span<const double> p, double x) {
    const double s = std::abs(depth(p, x));
    return p[stiffness] * reference_m * reference_m / (p[exponent] + 1) * std::pow(s / reference_m, p[exponent] + 1);
  };
  kind.check = [](std::span<const double> p) -> std::string {
    if (!std::isfinite(p[compression_gap]) && !std::isfinite(p[extension_gap]))
      return "\"compression_gap_m\", \"extension_gap_m\" or both";
    return "";
  };
  return kind;
}

}  // namespace wheelhop
