#include "core/plant/laws.hpp"

namespace wheelhop {
namespace {

enum { stiffness, relaxation };

}  // namespace

// The force is the state. A simulation step has to stay below 2.7 times the relaxation time.
LawKind maxwell_branch() {
  LawKind kind;
  kind.name = "maxwell_branch";
  kind.equation = "F' = k v - F / tau";
  kind.source = "J. C. Maxwell 1867: a spring and a damper k tau in series";
  kind.parameters = {{.name = "series_stiffness_n_per_m",
                      .unit = "N/m",
                      .meaning = "stiffness k; top mount, oil and gas 200,000 to 1,000,000 N/m",
                      .range = {.low = 1e-9},
                      .typical = 4e5},
                     {.name = "relaxation_s",
                      .unit = "s",
                      .meaning = "relaxation time tau; 0.001 to 0.01 s",
                      .range = {.low = 1e-7},
                      .typical = 0.004}};
  kind.memory.states = 1;
  kind.memory.force = [](std::span<const double> p, double, double v, const double* z, double& f, double* z_rate) {
    f = z[0];
    z_rate[0] = p[stiffness] * v - z[0] / p[relaxation];
    return true;
  };
  kind.memory.slopes = [](std::span<const double> p, double, double, const double*, MemorySlopes& s) {
    s.df_dz[0] = 1;
    s.dz_dv[0] = p[stiffness];
    s.dz_dz[0] = -1 / p[relaxation];
    return true;
  };
  kind.memory.jump = [](std::span<const double> p, double dx, double* z) { z[0] += p[stiffness] * dx; };
  kind.memory.energy = [](std::span<const double> p, const double* z) { return 0.5 * z[0] * z[0] / p[stiffness]; };
  kind.memory.dissipation = [](std::span<const double> p, double, double, const double* z) {
    return z[0] * z[0] / (p[stiffness] * p[relaxation]);
  };
  return kind;
}

}  // namespace wheelhop
