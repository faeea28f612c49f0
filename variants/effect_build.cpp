#include "variants/effect_build.hpp"

#include <cmath>
#include <stdexcept>

namespace wheelhop {
namespace {

// Relaxations in a hold interval, at most: a sooner memory is none at any frequency that a record holds, and only makes
// the equation stiffer than kSubsteps follow.
constexpr double kRelaxing = 2 * static_cast<double>(kSubsteps);

class FunctionEffect final : public Effect {
 public:
  FunctionEffect(std::string name,
                 std::function<void(const Plant&, const Operation&, std::vector<EffectCandidate>&)> function)
      : name_(std::move(name)), function_(std::move(function)) {}
  std::string name() const override { return name_; }
  std::vector<EffectCandidate> candidates(const Plant& plant, const Operation& operation) const override {
    std::vector<EffectCandidate> list;
    function_(plant, operation, list);
    return list;
  }

 private:
  std::string name_;
  std::function<void(const Plant&, const Operation&, std::vector<EffectCandidate>&)> function_;
};

}  // namespace

EffectCandidate with_law(const Plant& plant, std::size_t element, const std::string& effect, const std::string& form,
                         const std::string& law, std::vector<double> values,
                         const std::vector<std::pair<std::string, double>>& moved) {
  EffectCandidate candidate;
  candidate.effect = effect;
  candidate.form = form;
  candidate.plant = plant;
  Element& place = candidate.plant.elements[element];
  candidate.location = place.name;
  Law added;
  added.kind = find_law(law);
  if (!added.kind) throw std::invalid_argument("with_law: unknown law " + law);
  added.values = std::move(values);
  place.laws.push_back(added);
  int occurrence = 0;
  for (const Law& other : place.laws) occurrence += other.kind == added.kind;
  std::string prefix = place.name + "." + law;
  if (occurrence > 1) prefix.append("[").append(std::to_string(occurrence)).append("]");
  for (const auto& [name, scale] : moved) {
    candidate.parameters.push_back({prefix + "." + name, scale, 0});
    if (name == "relaxation_s") candidate.parameters.back().least = 1 / (kRelaxing * plant.hold_hz());
  }
  return candidate;
}

EffectCandidate with_path(const Plant& plant, const std::string& effect, const std::string& location,
                          const std::string& form, const std::vector<EffectParameter>& parameters) {
  EffectCandidate candidate;
  candidate.effect = effect;
  candidate.location = location;
  candidate.form = form;
  candidate.plant = plant;
  for (const EffectParameter& parameter : parameters) {
    set_parameter(candidate.plant, parameter.name, parameter.value);
    candidate.parameters.push_back({parameter.name, parameter.scale, 0});
  }
  return candidate;
}

bool at_drive(const Plant& plant, const Element& element) {
  for (const PlantInput& input : plant.inputs)
    if (input.kind == InputKind::displacement && (input.name == element.from || input.name == element.to)) return true;
  return false;
}

double viscous_damping(const Element& element) {
  double sum = 0;
  for (const Law& law : element.laws)
    if (law.kind->name == "viscous_damper") sum += law.values[0];
  return sum;
}

double stiffness_at_rest(const Element& element) {
  double sum = 0;
  for (const Law& law : element.laws) {
    double k = 0, d = 0;
    if (law.states() == 0 && law.kind->role == LawRole::force && law.slopes(0, 0, k, d)) sum += k;
  }
  return sum;
}

void plausibly(EffectCandidate& candidate, const std::string& parameter, double low, double high) {
  for (const FitParameter& own : candidate.parameters)
    if (own.name.ends_with("." + parameter)) {
      const bool strength = own.name == candidate.parameters.front().name;
      candidate.plausible.push_back({own.name, low, high, strength ? candidate.ideal : 0});
      return;
    }
  throw std::invalid_argument("plausibly: the candidate does not move " + parameter);
}

void followed_by_steps(EffectCandidate& candidate, const ElementOperation& operation) {
  const double step_s = 1 / (candidate.plant.hold_hz() * static_cast<double>(kMostSubsteps));
  for (FitParameter& parameter : candidate.parameters)
    if (parameter.name.ends_with(".yield_travel_m")) parameter.least = 0.5 * 3 * operation.rate_rms_m_per_s * step_s;
}

void defined_by(EffectCandidate& candidate, const std::string& parameter, double low, double high) {
  plausibly(candidate, parameter, low, high);
  candidate.plausible.back().defining = true;
}

void typically(EffectCandidate& candidate, const std::string& parameter, double value) {
  for (const FitParameter& own : candidate.parameters)
    if (own.name.ends_with("." + parameter)) {
      candidate.typical.emplace_back(own.name, value);
      return;
    }
  throw std::invalid_argument("typically: the candidate does not move " + parameter);
}

double third(double value) { return std::abs(value) / 3; }

std::shared_ptr<const Effect> effect_family(
    std::string name, std::function<void(const Plant&, const Operation&, std::vector<EffectCandidate>&)> candidates) {
  return std::make_shared<FunctionEffect>(std::move(name), std::move(candidates));
}

}  // namespace wheelhop
