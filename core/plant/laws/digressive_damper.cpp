#include <cmath>

#include "core/plant/laws.hpp"

namespace wheelhop {
namespace {

enum { damping, knee, exponent, sharpness };

/// (|v|/v_0)^m
double powered(std::span<const double> p, double v) {
  const double ratio = std::abs(v) / p[knee];
  return p[sharpness] == 1 ? ratio : std::pow(ratio, p[sharpness]);
}

double shape(std::span<const double> p, double v) {
  return std::pow(1 + powered(p, v), (p[exponent] - 1) / p[sharpness]) - 1;
}

}  // namespace

// Beside a viscous damper of at least the same damping the two are passive: their force has the sign of v.
LawKind digressive_damper() {
  LawKind kind;
  kind.name = "digressive_damper";
  kind.equation = "F = d v ((1 + (|v|/v_0)^m)^((n-1)/m) - 1), beside a viscous damper d";
  kind.source = "blow-off (n < 1) or orifice flow (n > 1) as a departure from a viscous damper";
  kind.parameters = {{.name = "damping_ns_per_m",
                      .unit = "Ns/m",
                      .meaning = "damping d of the damper that is corrected",
                      .range = {.low = 0},
                      .typical = 1500},
                     {.name = "knee_velocity_m_per_s",
                      .unit = "m/s",
                      .meaning = "speed v_0 at which the exponent takes over; 0.1 to 0.3 m/s",
                      .range = {.low = 1e-6},
                      .typical = 0.2},
                     {.name = "exponent",
                      .unit = "-",
                      .meaning = "n of the force at large speed: 0 saturates, 1 is linear, 2 is an orifice",
                      .range = {.low = -1, .high = 3},
                      .required = false,
                      .fallback = 0,
                      .typical = 0.5},
                     {.name = "sharpness",
                      .unit = "-",
                      .meaning = "m of the knee: 1 bends from standstill on, 2 is smooth there, 6 is nearly a corner",
                      .range = {.low = 0.5, .high = 8},
                      .required = false,
                      .fallback = 1,
                      .typical = 2}};
  kind.force = [](std::span<const double> p, double, double v, double& f) {
    f = p[damping] * v * shape(p, v);
    return true;
  };
  kind.slopes = [](std::span<const double> p, double, double v, double& df_dx, double& df_dv) {
    const double ratio = powered(p, v);
    df_dx = 0;
    df_dv = p[damping] *
            (shape(p, v) + ratio * (p[exponent] - 1) * std::pow(1 + ratio, (p[exponent] - 1) / p[sharpness] - 1));
    return true;
  };
  kind.dissipation = [](std::span<const double> p, double, double v) { return p[damping] * v * v * shape(p, v); };
  kind.is_correction = true;
  return kind;
}

}  // namespace wheelhop
