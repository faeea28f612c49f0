#include "core/gap/which/parameter_label.hpp"

#include <algorithm>
#include <array>
#include <string_view>

#include "core/base/status.hpp"

namespace wheelhop {
namespace {

/// Stiffness and damping of all elements together, at a travel and rate.
std::array<double, 2> slopes_at(const Plant& plant, double x, double v) {
  std::array<double, 2> sum = {0, 0};
  for (const Element& element : plant.elements)
    for (const Law& law : element.laws) {
      double k = 0, d = 0;
      if (law.states() > 0 || !law.slopes(x, v, k, d)) continue;
      sum[0] += k;
      sum[1] += d;
    }
  return sum;
}

struct ErrorOf {
  std::string_view part;    ///< of a parameter's name
  std::string_view effect;  ///< id
};

/// Masses, loads, parameters of drive and sensor paths, and of laws with a memory, which have no slopes at rest.
constexpr ErrorOf kNamed[] = {{"load:", "load"},
                              {"mass_kg", "mass_error"},
                              {".gain", "gain_error"},
                              {".crosstalk", "crosstalk"},
                              {".offset", "bias"},
                              {".bias", "bias"},
                              {".drift", "drift"},
                              {".quantum", "quantisation"},
                              {".delay_s", "time_delay"},
                              {".sampling_phase", "time_delay"},
                              {".high_pass_hz", "high_pass"},
                              {".rate_limit", "rate_limit"},
                              {".saturation", "saturation"},
                              {".clock_skew", "clock_skew"},
                              {".bouc_wen", "hysteresis"},
                              {".maxwell_branch", "series_compliance"},
                              {".damper_mount", "series_compliance"},
                              {".cavitating_damper", "cavitation"},
                              {".fading_damper", "damper_fade"},
                              {".inerter", "inertance"}};

/// What an error of a parameter is called: what it changes at rest, or how it bends a law away from there.
std::string error_id(const Plant& plant, const PlantParameter& parameter) {
  constexpr double away = 1e-3;  // m, m/s
  if (parameter.name.find(".lag.") != std::string::npos)
    return place_from(parameter.location).kind == PlaceKind::sensor ? "sensor_lag" : "actuator_lag";
  for (const ErrorOf& named : kNamed)
    if (parameter.name.find(named.part) != std::string::npos) return std::string(named.effect);
  Plant moved = plant;
  set_parameter(moved, parameter.name, 1.1 * parameter.value);
  const auto rest = slopes_at(plant, 0, 0), moved_rest = slopes_at(moved, 0, 0);
  if (rest[1] != moved_rest[1]) return "damping_error";
  if (rest[0] != moved_rest[0]) return "stiffness_error";
  const auto there = slopes_at(plant, away, away), moved_there = slopes_at(moved, away, away);
  if (there[0] != moved_there[0]) return "spring_nonlinearity";
  return there[1] != moved_there[1] ? "damper_nonlinearity" : "stiffness_error";
}

}  // namespace

ParameterLabel label_of(const Plant& plant, const std::string& parameter) {
  const std::vector<PlantParameter> parameters = plant_parameters(plant);
  const auto known = std::find_if(parameters.begin(), parameters.end(),
                                  [&](const PlantParameter& own) { return own.name == parameter; });
  if (known == parameters.end()) throw UserError(parameter + ": expected a parameter of the plant");
  return {error_id(plant, *known), known->location};
}

}  // namespace wheelhop
