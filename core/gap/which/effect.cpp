#include "core/gap/which/effect.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace wheelhop {
namespace {

bool have_one_name(const EffectCandidate& a, const Label& of_a, const EffectCandidate& b, const Label& of_b) {
  return a.location == b.location && of_a.effect == of_b.effect;
}

/// A parameter's name in another plant: what it begins with, the law, is called `now` there.
std::string renamed(const std::string& name, const std::string& law, const std::string& now) {
  return !law.empty() && name.starts_with(law + ".") ? now + name.substr(law.size()) : name;
}

}  // namespace

std::optional<EffectCandidate> in_plant(const EffectCandidate& candidate, const Plant& plant) {
  if (!candidate.apply)
    throw std::invalid_argument("in_plant: " + to_string(name_of(candidate)) + " has no form to apply");
  std::optional<Applied> applied = candidate.apply(plant);
  if (!applied) return std::nullopt;
  EffectCandidate there = candidate;
  there.plant = std::move(applied->plant);
  there.law = std::move(applied->law);
  const auto rename = [&](std::string& name) { name = renamed(name, candidate.law, there.law); };
  for (FitParameter& parameter : there.parameters) rename(parameter.name);
  for (auto& [name, value] : there.typical) rename(name);
  for (Label& label : there.labels) {
    for (Plausible& plausible : label.plausible) rename(plausible.parameter);
    if (label.words) rename(label.words->parameter);
  }
  return there;
}

std::string form_of(const Label& label, const Plant& fitted) {
  if (!label.words) return label.form;
  return get_parameter(fitted, label.words->parameter) < label.words->turns_at ? label.words->below
                                                                               : label.words->above;
}

double Plausible::deviation(double value) const {
  constexpr double z90 = 1.6448536269514722;
  const double middle = 0.5 * std::log(low * high), spread = 0.5 * std::log(high / low) / z90;
  return (std::log(std::max({std::abs(value - ideal), least, 1e-300})) - middle) / spread;
}

EffectAt name_of(const EffectCandidate& candidate) { return name_of(candidate, candidate.label()); }

EffectAt name_of(const EffectCandidate& candidate, const Label& label) { return {label.effect, candidate.location}; }

bool same_form(const EffectCandidate& a, const EffectCandidate& b) {
  if (a.location != b.location) return false;
  return std::any_of(a.labels.begin(), a.labels.end(), [&](const Label& own) {
    return std::any_of(b.labels.begin(), b.labels.end(),
                       [&](const Label& other) { return own.effect == other.effect && own.form == other.form; });
  });
}

std::vector<std::vector<std::size_t>> labellings(const std::vector<EffectCandidate>& effects) {
  std::vector<std::vector<std::size_t>> all = {{}};
  for (const EffectCandidate& effect : effects) {
    std::vector<std::vector<std::size_t>> longer;
    for (const std::vector<std::size_t>& before : all)
      for (std::size_t own = 0; own < effect.labels.size(); ++own) {
        bool taken = false;
        for (std::size_t i = 0; i < before.size(); ++i)
          taken = taken || have_one_name(effects[i], effects[i].labels[before[i]], effect, effect.labels[own]);
        if (taken) continue;
        longer.push_back(before);
        longer.back().push_back(own);
      }
    all = std::move(longer);
  }
  return all;
}

double log_plausibility(const Label& label, const Plant& fitted) {
  double sum = 0;
  for (const Plausible& plausible : label.plausible) {
    const double z = plausible.deviation(get_parameter(fitted, plausible.parameter));
    sum -= 0.5 * z * z;
  }
  return sum;
}

EffectCandidate at_typical_size(EffectCandidate candidate) {
  for (const auto& [name, value] : candidate.typical) set_parameter(candidate.plant, name, value);
  return candidate;
}

}  // namespace wheelhop
