#include "core/gap/which/effect.hpp"

#include <fmt/format.h>

#include <cmath>

#include "core/plant/rotary.hpp"

namespace wheelhop {

namespace {

constexpr double kUndefined = 2.5;  // standard deviations: one in eighty of the true ones

}  // namespace

double Plausible::deviation(double value) const {
  constexpr double z90 = 1.6448536269514722;
  const double middle = 0.5 * std::log(low * high), spread = 0.5 * std::log(high / low) / z90;
  return (std::log(std::max(std::abs(value - ideal), 1e-300)) - middle) / spread;
}

double log_plausibility(const EffectCandidate& candidate, const Plant& fitted) {
  double sum = 0;
  for (const Plausible& plausible : candidate.plausible) {
    const double z = plausible.deviation(get_parameter(fitted, plausible.parameter));
    sum -= 0.5 * z * z;
  }
  return sum;
}

std::string undefined_size(const EffectCandidate& candidate, const Plant& fitted) {
  for (const Plausible& plausible : candidate.plausible) {
    const double value = get_parameter(fitted, plausible.parameter);
    if (plausible.defining && plausible.deviation(value) > kUndefined)
      return fmt::format("{} {:.2g}, usually {:g} to {:g}", shown_name(fitted, plausible.parameter), value,
                         plausible.low, plausible.high);
  }
  return "";
}

std::vector<EffectCandidate> under_all_names(const EffectCandidate& candidate) {
  std::vector<EffectCandidate> all = {candidate};
  for (const OtherName& name : candidate.other_names) {
    EffectCandidate other = candidate;
    other.effect = name.effect;
    other.form = name.form;
    other.plausible = name.plausible;
    other.other_names.clear();
    all.push_back(std::move(other));
  }
  return all;
}

EffectCandidate at_typical_size(EffectCandidate candidate) {
  for (const auto& [name, value] : candidate.typical) set_parameter(candidate.plant, name, value);
  return candidate;
}

}  // namespace wheelhop
