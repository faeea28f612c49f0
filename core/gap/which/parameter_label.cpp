#include "core/gap/which/parameter_label.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <string_view>

#include "core/base/status.hpp"
#include "core/plant/schedule.hpp"

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

/// Stiffness of an element without its laws with memory; none beyond the travel that one of them allows.
std::optional<double> stiffness_at(const Element& element, double x) {
  double sum = 0;
  for (const Law& law : element.laws) {
    double k = 0, d = 0;
    if (law.states() > 0) continue;
    if (!law.slopes(x, 0, k, d)) return {};
    sum += k;
  }
  return sum;
}

/// The travel that the laws of an element allow; 0 if they allow any.
double travel_allowed(const Element& element) {
  double inside = 1e-6, outside = 1e3;  // m
  if (stiffness_at(element, outside)) return 0;
  while (outside > 1.01 * inside) {
    const double middle = std::sqrt(inside * outside);
    (stiffness_at(element, middle) ? inside : outside) = middle;
  }
  return inside;
}

/// True of a number that shapes a spring with ends instead of scaling it: half way to an end, or close to it, the
/// stiffness changes by a share that is more than twice or less than half of what it is at rest.
bool shapes_spring(const Plant& own, const Plant& moved, const Place& place) {
  for (std::size_t i = 0; i < own.elements.size(); ++i) {
    if (location_of(own.elements[i]) != place) continue;
    const double allowed = travel_allowed(own.elements[i]);
    const auto share = [&](double x) {
      const auto before = stiffness_at(own.elements[i], x), after = stiffness_at(moved.elements[i], x);
      return before && after ? std::abs(*after / *before - 1) : 0.0;
    };
    const auto differs = [&](double x) { return share(x) > 2 * share(0) || share(0) > 2 * share(x); };
    return allowed > 0 && (differs(0.5 * allowed) || differs(0.9 * allowed));
  }
  return false;
}

struct Word {
  std::string_view of;
  const char* effect;
};

constexpr Word kOfPaths[] = {{"gain", "gain_error"},
                             {"offset", "bias"},
                             {"bias", "bias"},
                             {"drift_per_s", "drift"},
                             {"drift_settling_per_s", "drift"},
                             {"quantum", "quantisation"},
                             {"delay_s", "time_delay"},
                             {"sampling_phase", "time_delay"},
                             {"high_pass_hz", "high_pass"},
                             {"rate_limit", "rate_limit"},
                             {"saturation", "saturation"},
                             {"saturation_sharpness", "saturation"}};
constexpr std::string_view kOfLags[] = {"lag.time_constant_s", "lag.cutoff_hz", "lag.damping_ratio"};

/// Laws that have no slopes at rest of their own, by their memory or as they act on accelerations, and the one that
/// shifts where a spring rests: an error has one name, whichever of their numbers is wrong.
constexpr Word kOfLaws[] = {
    {"bouc_wen", "hysteresis"},          {"maxwell_branch", "series_compliance"}, {"damper_mount", "series_compliance"},
    {"cavitating_damper", "cavitation"}, {"fading_damper", "damper_fade"},        {"inerter", "inertance"},
    {"rest_offset", "static_offset"}};

EffectId error_of_path(const ParameterHandle& handle) {
  for (const std::string_view number : kOfLags)
    if (handle.number == number) return handle.owner == ParameterOwner::sensor_path ? "sensor_lag" : "actuator_lag";
  for (const Word& word : kOfPaths)
    if (handle.number == word.of) return word.effect;
  throw std::logic_error("an error of the path's " + handle.number + " has no name");
}

/// What a wrong number of a law changes at rest, or how it bends the law away from there.
EffectId error_of_law(const Plant& plant, const PlantParameter& parameter) {
  for (const Word& word : kOfLaws)
    if (parameter.handle.law->name == word.of) return word.effect;
  constexpr double away = 1e-3;  // m, m/s
  Plant moved = plant;
  set_parameter(moved, parameter.name, 1.1 * parameter.value);
  // With schedules at their high ends, where a wrong slope shows.
  moved = at_ends_of_schedules(moved).back();
  const Plant own = at_ends_of_schedules(plant).back();
  const auto rest = slopes_at(own, 0, 0), moved_rest = slopes_at(moved, 0, 0);
  if (rest[1] != moved_rest[1]) return "damping_error";
  if (shapes_spring(own, moved, parameter.handle.place)) return "spring_nonlinearity";
  if (rest[0] != moved_rest[0]) return "stiffness_error";
  const auto there = slopes_at(own, away, away), moved_there = slopes_at(moved, away, away);
  if (there[0] != moved_there[0]) return "spring_nonlinearity";
  return there[1] != moved_there[1] ? "damper_nonlinearity" : "stiffness_error";
}

EffectId error_id(const Plant& plant, const PlantParameter& parameter) {
  switch (parameter.handle.owner) {
    case ParameterOwner::mass: return "mass_error";
    case ParameterOwner::law: return error_of_law(plant, parameter);
    case ParameterOwner::load: return "load";
    case ParameterOwner::drive_path:
    case ParameterOwner::sensor_path: return error_of_path(parameter.handle);
    case ParameterOwner::crosstalk: return "crosstalk";
    case ParameterOwner::clock: return "clock_skew";
  }
  throw std::logic_error("an owner of parameters without a name for their errors");
}

}  // namespace

ParameterLabel label_of(const Plant& plant, const std::string& parameter) {
  const std::vector<PlantParameter> parameters = plant_parameters(plant);
  const auto known = std::find_if(parameters.begin(), parameters.end(),
                                  [&](const PlantParameter& own) { return own.name == parameter; });
  if (known == parameters.end()) throw UserError(parameter + ": expected a parameter of the plant");
  return {error_id(plant, *known), known->handle.place};
}

}  // namespace wheelhop
