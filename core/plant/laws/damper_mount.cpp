#include "core/plant/laws.hpp"

namespace wheelhop {
namespace {

enum { damping, relaxation };

}  // namespace

// The state is the force of damper and mount, one behind the other. Like that of a Maxwell branch it asks for steps
// below 2.7 times the relaxation time.
LawKind damper_mount() {
  LawKind kind;
  kind.name = "damper_mount";
  kind.equation = "F = z - d v, z' = (d v - z) / tau, beside a viscous damper d";
  kind.source = "rubber of stiffness d / tau between the damper and what it holds on to";
  kind.parameters = {{.name = "damping_ns_per_m",
                      .unit = "Ns/m",
                      .meaning = "damping d of the damper that is corrected",
                      .range = {.low = 1e-9},
                      .typical = 1500},
                     {.name = "relaxation_s",
                      .unit = "s",
                      .meaning = "d over the stiffness of the mount; 0.001 to 0.01 s",
                      .range = {.low = 1e-7},
                      .typical = 0.004}};
  kind.memory.states = 1;
  kind.memory.force = [](std::span<const double> p, double, double v, const double* z, double& f, double* z_rate) {
    f = z[0] - p[damping] * v;
    z_rate[0] = (p[damping] * v - z[0]) / p[relaxation];
    return true;
  };
  kind.memory.slopes = [](std::span<const double> p, double, double, const double*, MemorySlopes& s) {
    s.df_dz[0] = 1;
    s.df_dv = -p[damping];
    s.dz_dv[0] = p[damping] / p[relaxation];
    s.dz_dz[0] = -1 / p[relaxation];
    return true;
  };
  kind.memory.energy = [](std::span<const double> p, const double* z) {
    return 0.5 * z[0] * z[0] * p[relaxation] / p[damping];
  };
  kind.memory.dissipation = [](std::span<const double> p, double, double v, const double* z) {
    return z[0] * z[0] / p[damping] - p[damping] * v * v;
  };
  kind.is_correction = true;
  return kind;
}

}  // namespace wheelhop
