#include <cmath>
#include <numbers>

#include "core/plant/laws.hpp"
#include "core/plant/tan_inside.hpp"

namespace wheelhop {
namespace {

enum { stiffness, alpha, beta, travel_limit };

// Without the tangent term there is no pole: the travel limit then bounds nothing.
bool has_pole(std::span<const double> p) { return p[beta] != 0 && std::isfinite(p[travel_limit]); }

// A negated comparison, so that NaN counts as outside. Beyond the pole the tangent would come back from minus infinity
// and push the stop open: a step that jumps over the pole must be refused, not computed.
bool outside(std::span<const double> p, double x) { return !(std::abs(x) < p[travel_limit]); }

template <class V>
V cubic(const V* p, V x) {
  return x + p[alpha] * x * x * x;
}

template <class V>
V end_stop(const V* p, V x) {
  return p[beta] * tan_inside(V(0.5 * std::numbers::pi) / p[travel_limit] * x);
}

}  // namespace

LawKind hardening_spring() {
  LawKind kind;
  kind.name = "hardening_spring";
  kind.equation = "F = c (x + alpha x^3 + beta tan(pi x / (2 x_max))), |x| < x_max";
  kind.source = "suspension spring with progressive stiffness and end stop";
  kind.parameters = {
      {.name = "stiffness_n_per_m", .unit = "N/m", .meaning = "factor c of the whole law", .range = {.low = 0}},
      {.name = "alpha_per_m2", .unit = "1/m^2", .meaning = "cubic share alpha", .required = false},
      {.name = "beta_m", .unit = "m", .meaning = "end-stop share beta", .range = {.low = 0}, .required = false},
      {.name = "travel_limit_m",
       .unit = "m",
       .meaning = "travel x_max of the end stop; needed where beta is not 0",
       .range = {.low = 1e-9},
       .required = false,
       .fallback = std::numeric_limits<double>::infinity()}};
  kind.force = [](std::span<const double> p, double x, double, double& f) {
    double shape = cubic(p.data(), x);
    if (has_pole(p)) {
      if (outside(p, x)) return false;
      shape += end_stop(p.data(), x);
    }
    f = p[stiffness] * shape;
    return true;
  };
  kind.force_of_lanes = [](const Lanes* p, Lanes x, Lanes, Lanes& f) {
    // Without a pole the limit is infinite or counts as such, and the end stop's share is 0.
    const Lanes infinity = std::numeric_limits<double>::infinity();
    const Lanes limit = choose(p[beta] == Lanes(0.0), infinity, p[travel_limit]);
    const LaneMask inside = absolute(x) < limit;
    const Lanes own[] = {p[stiffness], p[alpha], p[beta], limit};
    f = p[stiffness] * (cubic(p, x) + end_stop(own, x));
    return inside;
  };
  kind.slopes = [](std::span<const double> p, double x, double, double& df_dx, double& df_dv) {
    double slope = 1 + 3 * p[alpha] * x * x;
    if (has_pole(p)) {
      if (outside(p, x)) return false;
      const double rate = 0.5 * std::numbers::pi / p[travel_limit];
      const double tangent = tan_inside(rate * x);
      slope += p[beta] * rate * (1 + tangent * tangent);
    }
    df_dx = p[stiffness] * slope;
    df_dv = 0;
    return true;
  };
  kind.gradient = [](std::span<const double> p, double x, double, double* df_dp) {
    double shape = cubic(p.data(), x);
    df_dp[alpha] = p[stiffness] * x * x * x;
    df_dp[beta] = df_dp[travel_limit] = 0;
    if (std::isfinite(p[travel_limit])) {
      if (outside(p, x)) return false;
      const double angle = 0.5 * std::numbers::pi * x / p[travel_limit], tangent = tan_inside(angle);
      shape += p[beta] * tangent;
      df_dp[beta] = p[stiffness] * tangent;
      df_dp[travel_limit] = -p[stiffness] * p[beta] * (1 + tangent * tangent) * angle / p[travel_limit];
    }
    df_dp[stiffness] = shape;
    return true;
  };
  kind.energy = [](std::span<const double> p, double x) {
    double shape = 0.5 * x * x + 0.25 * p[alpha] * x * x * x * x;
    if (has_pole(p)) {
      const double rate = 0.5 * std::numbers::pi / p[travel_limit];
      shape -= p[beta] / rate * std::log(std::cos(rate * x));
    }
    return p[stiffness] * shape;
  };
  kind.check = [](std::span<const double> p) -> std::string {
    if (p[beta] != 0 && !std::isfinite(p[travel_limit])) return "\"travel_limit_m\" beside a \"beta_m\" that is not 0";
    return "";
  };
  return kind;
}

}  // namespace wheelhop
