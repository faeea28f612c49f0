#include <cmath>

#include "core/plant/laws.hpp"

namespace wheelhop {
namespace {

enum { force, stribeck_force, stribeck_velocity, velocity };

}  // namespace

// The sign function is smoothed: a step over the corner of the true one would chatter. About its centre the law is a
// damper of force / velocity, so that the step h of a simulation has to stay below 2.5 m velocity / force.
LawKind coulomb_friction() {
  LawKind kind;
  kind.name = "coulomb_friction";
  kind.equation = "F = (F_c + F_s exp(-(v/v_s)^2)) tanh(v/v_0)";
  kind.source = "C. A. Coulomb 1785; R. Stribeck 1902";
  kind.parameters = {{.name = "force_n",
                      .unit = "N",
                      .meaning = "sliding friction F_c; a strut has 20 to 100 N, with side load 150 N",
                      .range = {.low = 0},
                      .typical = 40},
                     {.name = "stribeck_force_n",
                      .unit = "N",
                      .meaning = "what breaking away takes beyond F_c; 0 to 0.5 F_c",
                      .range = {.low = 0},
                      .required = false},
                     {.name = "stribeck_velocity_m_per_s",
                      .unit = "m/s",
                      .meaning = "speed v_s over which that decays; 0.01 to 0.1 m/s",
                      .range = {.low = 1e-6},
                      .required = false,
                      .fallback = 0.05,
                      .typical = 0.05},
                     {.name = "velocity_m_per_s",
                      .unit = "m/s",
                      .meaning = "speed v_0 over which the sign is smoothed; 0.001 to 0.02 m/s",
                      .range = {.low = 1e-6},
                      .required = false,
                      .fallback = 0.005,
                      .typical = 0.005}};
  kind.force = [](std::span<const double> p, double, double v, double& f) {
    double size = p[force];
    if (p[stribeck_force] != 0) {
      const double ratio = v / p[stribeck_velocity];
      size += p[stribeck_force] * std::exp(-ratio * ratio);
    }
    f = size * std::tanh(v / p[velocity]);
    return true;
  };
  kind.slopes = [](std::span<const double> p, double, double v, double& df_dx, double& df_dv) {
    const double ratio = v / p[stribeck_velocity], sign = std::tanh(v / p[velocity]);
    const double sticking = p[stribeck_force] * std::exp(-ratio * ratio);
    df_dx = 0;
    df_dv =
        (p[force] + sticking) * (1 - sign * sign) / p[velocity] - 2 * sticking * ratio / p[stribeck_velocity] * sign;
    return true;
  };
  kind.dissipation = [](std::span<const double> p, double, double v) {
    const double ratio = v / p[stribeck_velocity];
    return (p[force] + p[stribeck_force] * std::exp(-ratio * ratio)) * std::tanh(v / p[velocity]) * v;
  };
  return kind;
}

}  // namespace wheelhop
