#include <algorithm>
#include <cmath>

#include "core/plant/laws.hpp"

namespace wheelhop {
namespace {

enum { damping, dead_travel, side, onset };

// Rate toward the side on which the chamber runs empty.
double filling(std::span<const double> p, double v) { return std::copysign(1.0, p[side]) * v; }

/// Share of the force that is there again at a filling z; z leaves 0 ... 1 by round-off of a step only.
double come_back(std::span<const double> p, double z) {
  return p[onset] <= 1 ? z : std::pow(std::clamp(z, 0.0, 1.0), p[onset]);
}

}  // namespace

// The state is the share of the chamber that holds oil when the rod pulls: it fills over the dead travel and empties on
// the way back, so that the force is missing after each reversal. Beside a viscous damper of the same damping the two
// are d v z on that side and d v on the other.
LawKind cavitating_damper() {
  LawKind kind;
  kind.name = "cavitating_damper";
  kind.equation =
      "F = -d v (1 - z^n) where s v > 0, z' = (max(s v, 0) (1 - z) - max(-s v, 0) z) / x_g, beside a viscous "
      "damper d";
  kind.source = "vapour and air in a twin-tube damper; dead travel after reversal";
  kind.parameters = {
      {.name = "damping_ns_per_m",
       .unit = "Ns/m",
       .meaning = "damping d of the damper that is corrected",
       .range = {.low = 0},
       .typical = 1500},
      {.name = "dead_travel_m",
       .unit = "m",
       .meaning = "travel x_g over which the force comes back; 0.001 to 0.003 m",
       .range = {.low = 1e-6},
       .typical = 0.002},
      {.name = "side",
       .unit = "-",
       .meaning = "s: 1 where growing travel (rebound) is weakened, -1 where shrinking",
       .range = {.low = -1, .high = 1},
       .required = false,
       .fallback = 1,
       .typical = 1},
      {.name = "onset",
       .unit = "-",
       .meaning = "exponent n: 1 (and below) where the force comes back from the start, more where it waits first",
       .range = {.low = 0},
       .required = false,
       .fallback = 1,
       .typical = 2}};
  kind.check = [](std::span<const double> p) -> std::string {
    return std::abs(p[side]) == 1 ? "" : "\"side\": 1 or -1";
  };
  kind.is_correction = true;
  kind.memory.states = 1;
  kind.memory.force = [](std::span<const double> p, double, double v, const double* z, double& f, double* z_rate) {
    const double rate = filling(p, v);
    f = rate > 0 ? -p[damping] * v * (1 - come_back(p, z[0])) : 0;
    z_rate[0] = (rate > 0 ? rate * (1 - z[0]) : rate * z[0]) / p[dead_travel];
    return true;
  };
  kind.memory.slopes = [](std::span<const double> p, double, double v, const double* z, MemorySlopes& s) {
    const double rate = filling(p, v), sign = filling(p, 1);
    s.df_dv = rate > 0 ? -p[damping] * (1 - come_back(p, z[0])) : 0;
    const double steep = p[onset] <= 1 ? 1 : p[onset] * std::pow(std::clamp(z[0], 0.0, 1.0), p[onset] - 1);
    s.df_dz[0] = rate > 0 ? p[damping] * v * steep : 0;
    s.dz_dv[0] = sign * (rate > 0 ? 1 - z[0] : z[0]) / p[dead_travel];
    s.dz_dz[0] = -std::abs(rate) / p[dead_travel];
    return true;
  };
  kind.memory.energy = [](std::span<const double>, const double*) { return 0.0; };
  kind.memory.dissipation = [](std::span<const double> p, double, double v, const double* z) {
    return filling(p, v) > 0 ? -p[damping] * v * v * (1 - come_back(p, z[0])) : 0.0;
  };
  return kind;
}

}  // namespace wheelhop
