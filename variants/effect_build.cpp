#include "variants/effect_build.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace wheelhop {
namespace {

// Relaxations in a hold interval, at most: a sooner memory is none at any frequency that a record holds, and only makes
// the equation stiffer than kSubsteps follow.
constexpr double kRelaxing = 2 * static_cast<double>(kSubsteps);

// Stiffness of a suspension over that of its tyre, at most: a judgement; 1/12 to 1/5 in cars, 0.36 on a rig of plates,
// and about 1 between the storeys of a frame.
constexpr double kCarried = 0.5;
// A judgement: a first fit of the speed over which a sign is smoothed ends at this share of where it starts.
constexpr double kSmoothedAtFirst = 1;

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

/// How number k of what corrects a damper follows a drive: as the damping does, so that both stay the same.
Schedule schedule_of_damper(const Element& element, std::size_t k) {
  for (const Law& law : element.laws)
    if (law.scheduled() && law.kind->name == "viscous_damper")
      return {law.schedule.by, {{k, law.schedule.slopes.front().second}}, law.schedule.tolerance};
  return {};
}

/// How the strength of a law (number k) may follow a drive where a law beside it does: in the same proportion, where a
/// fit starts.
Schedule schedule_beside(const Element& element, const Law& added, std::size_t k) {
  for (const Law& law : element.laws) {
    if (!law.scheduled()) continue;
    const auto [number, slope] = law.schedule.slopes.front();
    if (law.values[number] == 0 || slope == 0 || added.values[k] == 0) continue;
    return {law.schedule.by, {{k, added.values[k] * slope / law.values[number]}}, law.schedule.tolerance};
  }
  return {};
}

/// The element between the ground and a mass, of any name; the number of elements if there is none.
std::size_t joint_to_ground(const Plant& plant, const std::string& mass) {
  const auto joins = [&](const Element& element) {
    return (element.from == "ground" && element.to == mass) || (element.from == mass && element.to == "ground");
  };
  return static_cast<std::size_t>(std::find_if(plant.elements.begin(), plant.elements.end(), joins) -
                                  plant.elements.begin());
}

template <class Parts>
auto find_named(Parts& parts, const std::string& name) {
  return std::find_if(parts.begin(), parts.end(), [&](const auto& part) { return part.name == name; });
}

/// A law at an element, or at the guide of a mass, which then becomes an element where it is none yet.
std::optional<Applied> law_in(const Plant& plant, const std::string& element, const std::string& mass,
                              const Law& added) {
  Applied applied{plant};
  std::vector<Element>& elements = applied.plant.elements;
  auto place = find_named(elements, element);
  if (place == elements.end()) {
    if (find_named(plant.masses, mass) == plant.masses.end()) return std::nullopt;
    place = elements.insert(elements.end(), {element, "ground", mass, {}});
  }
  Law law = added;
  // What corrects a damper has that one's damping, whatever it is in this plant: set_parameter() moves both as long as
  // they are equal. Other numbers that no fit moves stay as they were offered.
  for (std::size_t k = 0; added.kind->is_correction && k < law.values.size(); ++k)
    if (added.kind->parameters[k].name == "damping_ns_per_m") {
      law.values[k] = viscous_damping(*place);
      if (!(law.values[k] > 0)) return std::nullopt;
      law.schedule = schedule_of_damper(*place, k);
    }
  // What corrects a spring has that one's stiffness, likewise, where there is one.
  for (std::size_t k = 0; added.kind->corrects_spring && k < law.values.size(); ++k)
    if (added.kind->parameters[k].name == "stiffness_n_per_m") {
      const auto spring = std::find_if(place->laws.begin(), place->laws.end(),
                                       [](const Law& other) { return spring_stiffness(other) != nullptr; });
      if (spring != place->laws.end()) law.values[k] = *spring_stiffness(*spring);
    }
  place->laws.push_back(std::move(law));
  applied.law = law_name(*place, place->laws.size() - 1);
  return applied;
}

/// The whole name of a parameter that a candidate moves. @param parameter its last part
const std::string& moved_name(const EffectCandidate& candidate, const std::string& parameter) {
  for (const FitParameter& own : candidate.parameters)
    if (own.name.ends_with("." + parameter)) return own.name;
  throw std::invalid_argument("the candidate does not move " + parameter);
}

/// Sets `plant` and `law` of a candidate: its form in the plant that it is offered for.
void make_plant(EffectCandidate& candidate, const Plant& plant) {
  std::optional<Applied> applied = candidate.apply(plant);
  if (!applied) throw std::invalid_argument("the plant has no place for " + candidate.label().effect.text());
  candidate.plant = std::move(applied->plant);
  candidate.law = std::move(applied->law);
}

}  // namespace

std::vector<LawPlace> law_places(const Plant& plant, const Operation& operation) {
  std::vector<LawPlace> list;
  const auto is_guide = [&](std::size_t e) { return location_of(plant.elements[e]).kind == PlaceKind::guide; };
  for (std::size_t e = 0; e < plant.elements.size(); ++e)
    if (!is_guide(e)) list.push_back({e, {}, operation.elements[e]});
  for (std::size_t i = 0; i < plant.masses.size(); ++i) {
    const std::string& mass = plant.masses[i].name;
    const std::size_t joint = joint_to_ground(plant, mass);
    if (turns(plant, mass) || (joint < plant.elements.size() && !is_guide(joint))) continue;
    list.push_back({joint, mass, operation.guides[i]});
  }
  return list;
}

EffectCandidate with_law(const Plant& plant, const LawPlace& place, const EffectId& effect, const std::string& form,
                         const std::string& law, std::vector<double> values,
                         const std::vector<std::pair<std::string, double>>& moved) {
  Law added;
  added.kind = find_law(law);
  if (!added.kind) throw std::invalid_argument("with_law: unknown law " + law);
  added.values = std::move(values);
  if (!added.kind->parameters.front().is_list)
    for (std::size_t i = added.values.size(); i < added.kind->parameters.size(); ++i)
      added.values.push_back(added.kind->parameters[i].fallback);
  const bool joined = place.element < plant.elements.size();
  const std::string element = joined ? plant.elements[place.element].name : guide_element(place.mass);
  const std::vector<std::string> numbers = added.parameter_names();
  const auto strength = moved.empty() ? numbers.end() : std::find(numbers.begin(), numbers.end(), moved.front().first);
  if (joined && added.kind->role == LawRole::force && !added.kind->is_correction && strength != numbers.end())
    added.schedule =
        schedule_beside(plant.elements[place.element], added, static_cast<std::size_t>(strength - numbers.begin()));
  EffectCandidate candidate;
  candidate.apply = [added, element, mass = place.mass](const Plant& other) {
    return law_in(other, element, mass, added);
  };
  candidate.labels = {{effect, form}};
  make_plant(candidate, plant);
  candidate.location = location_of(*find_named(candidate.plant.elements, element));
  for (const auto& [name, scale] : moved) {
    candidate.parameters.push_back({candidate.law + "." + name, scale, 0});
    if (name == "relaxation_s") candidate.parameters.back().least = 1 / (kRelaxing * plant.hold_hz());
  }
  for (const auto& [number, slope] : added.schedule.slopes)
    candidate.parameters.push_back({candidate.law + ".scheduled." + numbers[number], third(slope), 0});
  return candidate;
}

EffectCandidate with_law(const Plant& plant, std::size_t element, const EffectId& effect, const std::string& form,
                         const std::string& law, std::vector<double> values,
                         const std::vector<std::pair<std::string, double>>& moved) {
  return with_law(plant, LawPlace{element, {}, {}}, effect, form, law, std::move(values), moved);
}

EffectCandidate with_path(const Plant& plant, const EffectId& effect, const Place& location, const std::string& form,
                          const std::vector<EffectParameter>& parameters, Addition addition) {
  EffectCandidate candidate;
  candidate.labels = {{effect, form}};
  candidate.location = location;
  // A drive that is not held has no hold interval, of which a sampling phase is a share.
  std::vector<EffectParameter> own = parameters;
  if (!plant.held())
    std::erase_if(own, [](const EffectParameter& parameter) { return parameter.name.ends_with(".sampling_phase"); });
  for (const EffectParameter& parameter : own) candidate.parameters.push_back({parameter.name, parameter.scale, 0});
  candidate.apply = [own, addition = std::move(addition)](const Plant& other) -> std::optional<Applied> {
    Applied applied{other};
    if (addition && !addition(applied.plant)) return std::nullopt;
    for (const EffectParameter& parameter : own) set_parameter(applied.plant, parameter.name, parameter.value);
    return applied;
  };
  make_plant(candidate, plant);
  return candidate;
}

EffectCandidate with_yielding(const Plant& plant, const LawPlace& place, const EffectId& first, double force,
                              double yield) {
  EffectCandidate candidate =
      with_law(plant, place, "coulomb_friction", "presliding", "bouc_wen", {force, yield, 1, 0.5, 0},
               {{"force_n", third(force)}, {"yield_travel_m", third(yield)}});
  followed_by_steps(candidate, place.operation);
  plausibly(candidate, "yield_travel_m", kLeastPresliding, kMostPresliding);
  also_called(candidate, "hysteresis", "Bouc-Wen");
  plausibly(candidate, "yield_travel_m", kLeastYield, kMostYield);
  if (first == "hysteresis") std::swap(candidate.labels.front(), candidate.labels.back());
  return candidate;
}

bool at_drive(const Plant& plant, const Element& element) {
  const auto driven = [&](const std::string& node) {
    return std::any_of(plant.inputs.begin(), plant.inputs.end(), [&](const PlantInput& input) {
      return input.kind == InputKind::displacement && input.name == node;
    });
  };
  const auto moves = [&](const std::string& node) { return node != "ground" && !driven(node); };
  return (driven(element.from) && moves(element.to)) || (driven(element.to) && moves(element.from));
}

bool is_tyre(const Plant& plant, const Element& element) {
  if (!at_drive(plant, element)) return false;
  const auto is_input = [&](const std::string& node) {
    return std::any_of(plant.inputs.begin(), plant.inputs.end(),
                       [&](const PlantInput& input) { return input.name == node; });
  };
  const std::string& wheel = is_input(element.from) ? element.to : element.from;
  const double stiffness = stiffness_at_rest(element);
  return std::any_of(plant.elements.begin(), plant.elements.end(), [&](const Element& other) {
    if (other.from != wheel && other.to != wheel) return false;
    const std::string& beyond = other.from == wheel ? other.to : other.from;
    return beyond != "ground" && !is_input(beyond) && stiffness_at_rest(other) < kCarried * stiffness;
  });
}

bool at_tyre(const Plant& plant, const LawPlace& place) {
  if (!place.guide()) return is_tyre(plant, plant.elements[place.element]);
  return std::any_of(plant.elements.begin(), plant.elements.end(), [&](const Element& element) {
    return (element.from == place.mass || element.to == place.mass) && is_tyre(plant, element);
  });
}

bool has_damper(const Element& element) {
  return std::any_of(element.laws.begin(), element.laws.end(), [](const Law& law) {
    return law.kind->name == "viscous_damper" || law.kind->name == "power_law_damper";
  });
}

double viscous_damping(const Element& element) {
  if (location_of(element).kind == PlaceKind::guide) return 0;
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
  const std::string& name = moved_name(candidate, parameter);
  const bool strength = name == candidate.parameters.front().name;
  candidate.labels.back().plausible.push_back({name, low, high, strength ? candidate.ideal : 0});
}

void followed_by_steps(EffectCandidate& candidate, const ElementOperation& operation) {
  const double step_s = 1 / (candidate.plant.hold_hz() * static_cast<double>(kMostSubsteps));
  for (FitParameter& parameter : candidate.parameters)
    if (parameter.name.ends_with(".yield_travel_m")) parameter.least = 0.5 * 3 * operation.rate_rms_m_per_s * step_s;
}

void smoothed_at_first(EffectCandidate& candidate) {
  for (FitParameter& parameter : candidate.parameters)
    if (parameter.name.ends_with(".velocity_m_per_s")) {
      parameter.least = kSmoothedAtFirst * get_parameter(candidate.plant, parameter.name);
      parameter.lowered = true;
    }
}

void also_called(EffectCandidate& candidate, const EffectId& effect, const std::string& form) {
  candidate.labels.push_back({effect, form});
}

void defined_by(EffectCandidate& candidate, const std::string& parameter, double low, double high) {
  plausibly(candidate, parameter, low, high);
  candidate.labels.back().plausible.back().defining = true;
}

void bends(EffectCandidate& candidate, const std::string& parameter, double turns_at, const std::string& below,
           const std::string& above) {
  Label& label = candidate.labels.back();
  label.form = fmt::format("{} or {}", below, above);
  label.words = {moved_name(candidate, parameter), turns_at, below, above};
}

void typically(EffectCandidate& candidate, const std::string& parameter, double value) {
  candidate.typical.emplace_back(moved_name(candidate, parameter), value);
}

double third(double value) { return std::abs(value) / 3; }

double usual_offset(const Sensor& sensor) {
  switch (sensor.kind) {
    case SensorKind::displacement: return 0.002;
    case SensorKind::velocity: return 0.01;
    case SensorKind::acceleration: return 0.1;
    case SensorKind::force: return 0;
  }
  return 0;
}

std::shared_ptr<const Effect> effect_family(
    std::string name, std::function<void(const Plant&, const Operation&, std::vector<EffectCandidate>&)> candidates) {
  return std::make_shared<FunctionEffect>(std::move(name), std::move(candidates));
}

}  // namespace wheelhop
