// Parameters that are not what their tolerance says.
#include <algorithm>
#include <cmath>

#include "experiments/rig/effects.hpp"

namespace wheelhop::blind {
namespace {

/// Sizes are tolerances.
constexpr double least_off = 4, most_off = 8;

std::vector<std::string> places_with(const Plan& plan, Quantity quantity) {
  std::vector<std::string> names;
  for (const Parameter& parameter : plan.parameters)
    if (parameter.quantity == quantity && std::find(names.begin(), names.end(), parameter.location) == names.end())
      names.push_back(parameter.location);
  return names;
}

/// The delivered value is off by the size times its tolerance; what was drawn inside the tolerance is replaced.
std::optional<Formed> off_tolerance(const Surroundings& rig, const std::string& place, Random& random,
                                    Quantity quantity) {
  for (std::size_t i = 0; i < rig.plan->parameters.size(); ++i) {
    const Parameter& parameter = rig.plan->parameters[i];
    if (parameter.location != place || parameter.quantity != quantity) continue;
    const auto at = static_cast<Index>(i);
    const double drawn = rig.theta(at) / parameter.value;
    // A value cannot lose more than most of itself.
    const double sign = parameter.tolerance * most_off < 0.7 ? either_sign(random) : 1;
    return Formed{least_off, most_off, [=, tolerance = parameter.tolerance](double size) {
                    const double off = sign * size * tolerance;
                    return TrueEffect{.strength = off, .unit = "-", .factors = {{at, (1 + off) / drawn}}};
                  }};
  }
  return std::nullopt;
}

template <Quantity quantity>
std::vector<std::string> places(const Plan& plan) {
  return places_with(plan, quantity);
}
template <Quantity quantity>
std::optional<Formed> formed(const Surroundings& rig, const std::string& place, Random& random) {
  return off_tolerance(rig, place, random, quantity);
}

}  // namespace

std::vector<EffectKind> parameter_kinds() {
  return {{"mass_error", "mass", places<Quantity::mass>, formed<Quantity::mass>},
          {"stiffness_error", "stiffness", places<Quantity::stiffness>, formed<Quantity::stiffness>},
          {"damping_error", "damping", places<Quantity::damping>, formed<Quantity::damping>}};
}

}  // namespace wheelhop::blind
