#include <cmath>

#include "core/plant/laws.hpp"

namespace wheelhop {
namespace {

enum { damping, asymmetry, knee, rebound_ratio, jounce_ratio };

double ratio_of(std::span<const double> p, double v) { return v > 0 ? p[rebound_ratio] : p[jounce_ratio]; }
double damping_of(std::span<const double> p, double v) { return p[damping] * (1 + (v > 0 ? 1 : -1) * p[asymmetry]); }

/// Share of a speed that is left below the knee, (1 + (v/v_0)^4)^(-1/4), and its derivative times v.
double below_knee(std::span<const double> p, double v, double* slope = nullptr) {
  const double u = v / p[knee], power = 1 + u * u * u * u, share = std::pow(power, -0.25);
  if (slope) *slope = -share * (power - 1) / power;
  return share;
}

double force_of(std::span<const double> p, double v) {
  const double ratio = ratio_of(p, v);
  if (ratio == 1) return p[asymmetry] * p[damping] * std::abs(v);
  return (damping_of(p, v) * (ratio + (1 - ratio) * below_knee(p, v)) - p[damping]) * v;
}

}  // namespace

// Beside a viscous damper of the same damping the two are d (1 + a sgn v) S(v), passive for |a| <= 1 and r >= 0.
LawKind asymmetric_damper() {
  LawKind kind;
  kind.name = "asymmetric_damper";
  kind.equation =
      "F = d (1 + a sgn v) S(v) - d v, S = r v + (1 - r) v / (1 + (v/v_0)^4)^(1/4), r that of the sign of v, beside a "
      "viscous damper d";
  kind.source = "rebound and jounce valves of a shock absorber: bleed below the knee, blow-off beyond it";
  kind.parameters = {{.name = "damping_ns_per_m",
                      .unit = "Ns/m",
                      .meaning = "damping d of the damper that is corrected",
                      .range = {.low = 0},
                      .typical = 1500},
                     {.name = "asymmetry",
                      .unit = "-",
                      .meaning = "a: growing travel is damped by d (1 + a), shrinking by d (1 - a); 0.2 to 0.5",
                      .range = {.low = -1, .high = 1},
                      .typical = 0.3},
                     {.name = "knee_velocity_m_per_s",
                      .unit = "m/s",
                      .meaning = "speed v_0 from which the other slope holds; 0.05 to 0.2 m/s",
                      .range = {.low = 1e-6},
                      .required = false,
                      .fallback = 0.1,
                      .typical = 0.1},
                     {.name = "rebound_ratio",
                      .unit = "-",
                      .meaning = "r where travel grows: slope beyond the knee over the slope below; 1 is straight",
                      .range = {.low = 0, .high = 5},
                      .required = false,
                      .fallback = 1,
                      .typical = 0.5},
                     {.name = "jounce_ratio",
                      .unit = "-",
                      .meaning = "r where travel shrinks; 1 is straight",
                      .range = {.low = 0, .high = 5},
                      .required = false,
                      .fallback = 1,
                      .typical = 0.5}};
  kind.force = [](std::span<const double> p, double, double v, double& f) {
    f = force_of(p, v);
    return true;
  };
  kind.slopes = [](std::span<const double> p, double, double v, double& df_dx, double& df_dv) {
    df_dx = 0;
    df_dv = 0;
    if (v == 0) return true;  // the middle of the slopes of both sides, which are d (1 + a) - d and d (1 - a) - d
    double slope = 0;
    const double ratio = ratio_of(p, v), share = below_knee(p, v, &slope);
    df_dv = damping_of(p, v) * (ratio + (1 - ratio) * (share + slope)) - p[damping];
    return true;
  };
  kind.dissipation = [](std::span<const double> p, double, double v) { return force_of(p, v) * v; };
  kind.is_correction = true;
  return kind;
}

}  // namespace wheelhop
