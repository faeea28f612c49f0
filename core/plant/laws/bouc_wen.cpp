#include <cmath>

#include "core/plant/laws.hpp"

namespace wheelhop {
namespace {

enum { force, yield_travel, exponent, beta, stiffening, stribeck_ratio, stribeck_velocity };

/// |z|^n; `pow` is what a simulation of this law spends its time on, and 1 and 2 are the exponents in use.
double powered(std::span<const double> p, double z) {
  const double size = std::abs(z);
  return p[exponent] == 1 ? size : p[exponent] == 2 ? size * size : std::pow(size, p[exponent]);
}

/// r exp(-(v/v_s)^2), by which slow sliding needs more than the limit force; `slope` is its derivative by v.
double stribeck(std::span<const double> p, double v, double* slope = nullptr) {
  if (slope) *slope = 0;
  if (p[stribeck_ratio] == 0) return 0;
  const double ratio = v / p[stribeck_velocity], excess = p[stribeck_ratio] * std::exp(-ratio * ratio);
  if (slope) *slope = -2 * ratio / p[stribeck_velocity] * excess;
  return excess;
}

/// Share of the rate that yielding takes away: z' = (v - yielding) / x_y. Without the division by sgn(z), so that v
/// and |v| alone are read.
double yielding(std::span<const double> p, double v, double z) {
  return powered(p, z) * (p[beta] * std::copysign(std::abs(v), z) + (1 - p[beta] - p[stiffening]) * v) /
         (1 + stribeck(p, v));
}

}  // namespace

// beta >= 1/2 makes the heat non-negative at every state: with less, the loop of a small cycle could turn around. With
// a stiffening above 1 loading takes from what 1/2 F_z x_y z^2 counts as stored, but every closed cycle still makes
// heat: unloading is steeper than loading.
LawKind bouc_wen() {
  LawKind kind;
  kind.name = "bouc_wen";
  kind.equation = "F = F_z z, z' = (v/x_y) (1 - |z|^n (beta sgn(v z) + 1 - beta - s) / (1 + r exp(-(v/v_s)^2)))";
  kind.source =
      "R. Bouc 1967; Y. K. Wen 1976, J. Eng. Mech. Div. ASCE 102; with r as in C. Canudas de Wit et al. 1995, IEEE "
      "Trans. Autom. Control 40(3)";
  kind.parameters = {{.name = "force_n",
                      .unit = "N",
                      .meaning = "limit force F_z; bushings and strut 30 to 300 N",
                      .range = {.low = 0},
                      .typical = 80},
                     {.name = "yield_travel_m",
                      .unit = "m",
                      .meaning = "travel x_y at which yielding sets in; 0.0002 to 0.004 m",
                      .range = {.low = 1e-7},
                      .typical = 0.001},
                     {.name = "exponent",
                      .unit = "-",
                      .meaning = "sharpness n of yielding; 1 to 3",
                      .range = {.low = 1, .high = 20},
                      .required = false,
                      .fallback = 1,
                      .typical = 1},
                     {.name = "beta",
                      .unit = "-",
                      .meaning = "1/2: unloading is elastic; 1: it is the mirror of loading",
                      .range = {.low = 0.5, .high = 1},
                      .required = false,
                      .fallback = 0.5,
                      .typical = 0.5},
                     {.name = "stiffening",
                      .unit = "-",
                      .meaning = "s; 0: loading yields to F_z; 1: it is straight; above: it stiffens, as of wire ropes",
                      .range = {.low = 0, .high = 2},
                      .required = false,
                      .fallback = 0,
                      .typical = 0},
                     {.name = "stribeck_ratio",
                      .unit = "-",
                      .meaning = "r, by which breaking away takes more than sliding (n = 1); 0 to 0.5",
                      .range = {.low = 0, .high = 5},
                      .required = false,
                      .fallback = 0,
                      .typical = 0},
                     {.name = "stribeck_velocity_m_per_s",
                      .unit = "m/s",
                      .meaning = "speed v_s over which that decays; 0.01 to 0.1 m/s",
                      .range = {.low = 1e-6},
                      .required = false,
                      .fallback = 0.05,
                      .typical = 0.05}};
  kind.memory.states = 1;
  kind.memory.force = [](std::span<const double> p, double, double v, const double* z, double& f, double* z_rate) {
    f = p[force] * z[0];
    z_rate[0] = (v - yielding(p, v, z[0])) / p[yield_travel];
    return true;
  };
  kind.memory.slopes = [](std::span<const double> p, double, double v, const double* z, MemorySlopes& s) {
    const double size = powered(p, z[0]);
    s.df_dz[0] = p[force];
    const double turn = v * z[0] > 0 ? 1 : v * z[0] < 0 ? -1 : 0;
    double slope;
    const double limit = 1 + stribeck(p, v, &slope);
    s.dz_dv[0] =
        (1 - size * (p[beta] * turn + 1 - p[beta] - p[stiffening]) / limit + yielding(p, v, z[0]) * slope / limit) /
        p[yield_travel];
    s.dz_dz[0] = z[0] == 0 ? 0 : -p[exponent] * yielding(p, v, z[0]) / (z[0] * p[yield_travel]);
    return true;
  };
  kind.memory.energy = [](std::span<const double> p, const double* z) {
    return 0.5 * p[force] * p[yield_travel] * z[0] * z[0];
  };
  kind.memory.dissipation = [](std::span<const double> p, double, double v, const double* z) {
    return p[force] * z[0] * yielding(p, v, z[0]);
  };
  return kind;
}

}  // namespace wheelhop
