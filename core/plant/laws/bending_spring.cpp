#include <cmath>

#include "core/plant/laws.hpp"

namespace wheelhop {
namespace {

enum { stiffness, knee, exponent };

double square(std::span<const double> p, double x) { return x * x / (p[knee] * p[knee]); }

/// (1 + (x/x_0)^2)^power - 1, exact near rest.
double bent(std::span<const double> p, double x, double power) { return std::expm1(power * std::log1p(square(p, x))); }

}  // namespace

// The difference from a spring of stiffness k, so that it may store less than nothing; beside one of at least that
// stiffness the two together do not.
LawKind bending_spring() {
  LawKind kind;
  kind.name = "bending_spring";
  kind.equation = "F = k x ((1 + (x/x_0)^2)^((n-1)/2) - 1), beside a spring k";
  kind.source = "air spring, bellows or rubber: softer (n < 1) or harder (n > 1) beyond a knee, without a pole";
  kind.parameters = {{.name = "stiffness_n_per_m",
                      .unit = "N/m",
                      .meaning = "stiffness k of the spring that is corrected",
                      .range = {.low = 0},
                      .typical = 24000},
                     {.name = "knee_travel_m",
                      .unit = "m",
                      .meaning = "travel x_0 at which the exponent takes over; 0.01 to 0.05 m",
                      .range = {.low = 1e-9},
                      .typical = 0.02},
                     {.name = "exponent",
                      .unit = "-",
                      .meaning = "n of the force at large travel: 0 saturates, 1 is linear, 3 is cubic",
                      .range = {.low = 0, .high = 5},
                      .typical = 0.5}};
  kind.force = [](std::span<const double> p, double x, double, double& f) {
    f = p[stiffness] * x * bent(p, x, 0.5 * (p[exponent] - 1));
    return true;
  };
  kind.slopes = [](std::span<const double> p, double x, double, double& df_dx, double& df_dv) {
    const double half = 0.5 * (p[exponent] - 1), s = square(p, x), own = bent(p, x, half);
    df_dx = p[stiffness] * (own + (1 + own) * 2 * half * s / (1 + s));
    df_dv = 0;
    return true;
  };
  kind.energy = [](std::span<const double> p, double x) {
    const double n = p[exponent] + 1;
    return p[stiffness] * (p[knee] * p[knee] / n * bent(p, x, 0.5 * n) - 0.5 * x * x);
  };
  kind.corrects_spring = true;
  return kind;
}

}  // namespace wheelhop
