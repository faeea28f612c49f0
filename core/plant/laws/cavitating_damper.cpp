#include <algorithm>
#include <cmath>

#include "core/plant/laws.hpp"

namespace wheelhop {
namespace {

enum { damping, dead_travel, side, onset };

constexpr double kRefill = 0.2;      // of the dead travel: what the way back takes to start it anew
constexpr double kRefillS = 2.5e-4;  // and the time that takes at least, so that a short travel is no stiff equation
constexpr double kFull = 4;          // dead travels after which the chamber is full: a longer stroke must not count,
                                     // or a short way back would not undo it

// Rate toward the side on which the chamber runs empty.
double filling(std::span<const double> p, double v) { return std::copysign(1.0, p[side]) * v; }

double unfilled(std::span<const double> p, double z) { return 1 / (1 + std::pow(std::max(z, 0.0), p[onset])); }

/// Share of the force that is missing after z dead travels: 1 at 0, 0 where the chamber is full.
double missing(std::span<const double> p, double z) {
  const double left = unfilled(p, kFull);
  return z < kFull ? (unfilled(p, z) - left) / (1 - left) : 0;
}

double missing_slope(std::span<const double> p, double z) {
  if (z <= 0 || z >= kFull) return 0;
  const double m = unfilled(p, z);
  return -p[onset] * m * (1 - m) / z / (1 - unfilled(p, kFull));
}

double refill(std::span<const double> p, double v) { return kRefill * p[dead_travel] + kRefillS * std::abs(v); }

}  // namespace

// The state counts the stroke since the last reversal in dead travels until the chamber is full; the way back takes it
// to 0. Beside a viscous damper of the same damping the two are about d v z^n / (1 + z^n) on that side, and d v on the
// other.
LawKind cavitating_damper() {
  LawKind kind;
  kind.name = "cavitating_damper";
  kind.equation =
      "F = -d v (m(z) - m(4)) / (1 - m(4)), m = 1 / (1 + z^n), and z' = s v / x_g up to z = 4 where s v > 0, else "
      "F = 0 and z' = s v z / (x_g / 5 + 0.25 ms |v|), beside a viscous damper d";
  kind.source = "vapour and air in a twin-tube damper; dead travel after reversal";
  kind.parameters = {
      {.name = "damping_ns_per_m",
       .unit = "Ns/m",
       .meaning = "damping d of the damper that is corrected",
       .range = {.low = 0},
       .typical = 1500},
      {.name = "dead_travel_m",
       .unit = "m",
       .meaning = "travel x_g after a reversal at which half the force is back; 0.001 to 0.003 m",
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
       .meaning = "exponent n: 1 where the force comes back from the start, 10 where it waits and is there at once",
       .range = {.low = 1, .high = 30},
       .required = false,
       .fallback = 10,
       .typical = 4}};
  kind.check = [](std::span<const double> p) -> std::string {
    return std::abs(p[side]) == 1 ? "" : "\"side\": 1 or -1";
  };
  kind.is_correction = true;
  kind.memory.states = 1;
  kind.memory.force = [](std::span<const double> p, double, double v, const double* z, double& f, double* z_rate) {
    const double rate = filling(p, v);
    f = rate > 0 ? -p[damping] * v * missing(p, z[0]) : 0;
    z_rate[0] = rate <= 0 ? rate * z[0] / refill(p, v) : z[0] < kFull ? rate / p[dead_travel] : 0;
    return true;
  };
  kind.memory.slopes = [](std::span<const double> p, double, double v, const double* z, MemorySlopes& s) {
    const double rate = filling(p, v), sign = filling(p, 1), back = refill(p, v);
    s.df_dv = rate > 0 ? -p[damping] * missing(p, z[0]) : 0;
    s.df_dz[0] = rate > 0 ? -p[damping] * v * missing_slope(p, z[0]) : 0;
    s.dz_dv[0] = rate <= 0      ? sign * z[0] * kRefill * p[dead_travel] / (back * back)
                 : z[0] < kFull ? sign / p[dead_travel]
                                : 0;
    s.dz_dz[0] = rate > 0 ? 0 : rate / back;
    return true;
  };
  kind.memory.dissipation = [](std::span<const double> p, double, double v, const double* z) {
    return filling(p, v) > 0 ? -p[damping] * v * v * missing(p, z[0]) : 0.0;
  };
  return kind;
}

}  // namespace wheelhop
