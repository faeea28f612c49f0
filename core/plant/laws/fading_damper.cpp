#include "core/plant/laws.hpp"

namespace wheelhop {
namespace {

enum { damping, fade, capacity, cooling };

double left(std::span<const double> p, double z) { return 1 / (1 + p[fade] * z); }

}  // namespace

// The state is the rise of temperature. Beside a viscous damper of the same damping the two are d v / (1 + a T).
LawKind fading_damper() {
  LawKind kind;
  kind.name = "fading_damper";
  kind.equation = "F = d v (1/(1 + a T) - 1), T' = d v^2 / ((1 + a T) C) - T / tau, beside a viscous damper d";
  kind.source = "viscosity of warming oil; one heat capacity and one cooling time";
  kind.parameters = {{.name = "damping_ns_per_m",
                      .unit = "Ns/m",
                      .meaning = "damping d, cold, of the damper that is corrected",
                      .range = {.low = 0},
                      .typical = 1500},
                     {.name = "fade_per_k",
                      .unit = "1/K",
                      .meaning = "a; 10 to 30 % of the damping lost over 50 K is 0.002 to 0.009",
                      .range = {.low = 0},
                      .typical = 0.005},
                     {.name = "heat_capacity_j_per_k",
                      .unit = "J/K",
                      .meaning = "C of oil and tube; 300 to 2000 J/K",
                      .range = {.low = 1e-6},
                      .required = false,
                      .fallback = 800,
                      .typical = 800},
                     {.name = "cooling_s",
                      .unit = "s",
                      .meaning = "time constant tau of cooling; 300 to 1000 s",
                      .range = {.low = 1e-3},
                      .required = false,
                      .fallback = 600,
                      .typical = 600}};
  kind.is_correction = true;
  kind.memory.states = 1;
  kind.memory.force = [](std::span<const double> p, double, double v, const double* z, double& f, double* z_rate) {
    f = p[damping] * v * (left(p, z[0]) - 1);
    z_rate[0] = p[damping] * left(p, z[0]) * v * v / p[capacity] - z[0] / p[cooling];
    return 1 + p[fade] * z[0] > 0;
  };
  kind.memory.slopes = [](std::span<const double> p, double, double v, const double* z, MemorySlopes& s) {
    const double share = left(p, z[0]);
    s.df_dv = p[damping] * (share - 1);
    s.df_dz[0] = -p[damping] * v * p[fade] * share * share;
    s.dz_dv[0] = 2 * p[damping] * share * v / p[capacity];
    s.dz_dz[0] = -p[damping] * p[fade] * share * share * v * v / p[capacity] - 1 / p[cooling];
    return 1 + p[fade] * z[0] > 0;
  };
  kind.memory.dissipation = [](std::span<const double> p, double, double v, const double* z) {
    return p[damping] * v * v * (left(p, z[0]) - 1);
  };
  return kind;
}

}  // namespace wheelhop
