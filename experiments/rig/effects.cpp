#include "experiments/rig/effects.hpp"

#include <algorithm>
#include <cmath>

namespace wheelhop::blind {

namespace {

/// Before a mass: between it and the ground.
const std::string guide_prefix = "guide:";

std::vector<EffectKind> joined(std::initializer_list<std::vector<EffectKind>> lists) {
  std::vector<EffectKind> all;
  for (const std::vector<EffectKind>& list : lists) all.insert(all.end(), list.begin(), list.end());
  return all;
}

}  // namespace

const std::vector<EffectKind>& effect_kinds(Family family) {
  static const std::vector<EffectKind> catalogue =
      joined({strut_kinds(), damper_kinds(), tyre_kinds(), mass_kinds(), drive_kinds(), sensor_kinds(),
              textbook_kinds(), textbook_path_kinds()});
  static const std::vector<EffectKind> unknown =
      joined({unknown_strut_kinds(), unknown_mass_kinds(), unknown_ground_kinds()});
  static const std::vector<EffectKind> parameter = parameter_kinds();
  static const std::vector<EffectKind> added = joined({added_plant_kinds(), added_path_kinds(), added_ground_kinds()});
  switch (family) {
    case Family::catalogue: return catalogue;
    case Family::unknown: return unknown;
    case Family::parameter: return parameter;
    default: return added;
  }
}

std::vector<std::string> struts(const Plan& plan) {
  std::vector<std::string> names;
  for (const PlanElement& element : plan.elements)
    if (!plan.at_drive(element) && plan.has(element, Quantity::damping) && plan.has(element, Quantity::stiffness))
      names.push_back(element.name);
  return names;
}

std::vector<std::string> driven_springs(const Plan& plan) {
  std::vector<std::string> names;
  for (const PlanElement& element : plan.elements)
    if (plan.at_drive(element)) names.push_back(element.name);
  return names;
}

std::vector<std::string> all_masses(const Plan& plan) {
  std::vector<std::string> names;
  for (Index i = 0; i < plan.mass_count(); ++i) {
    const bool ends = std::any_of(plan.elements.begin(), plan.elements.end(),
                                  [&](const PlanElement& element) { return element.from == i || element.to == i; });
    if (ends) names.push_back(plan.masses[static_cast<std::size_t>(i)]);
  }
  return names;
}

std::vector<std::string> guides(const Plan& plan) {
  const auto is_ground = [&](Index node) {
    const Node& end = plan.nodes[static_cast<std::size_t>(node)];
    return end.weights.empty() && end.input < 0;
  };
  std::vector<std::string> names;
  for (const std::string& mass : all_masses(plan)) {
    const Index i = mass_at(plan, mass);
    const bool guided = std::any_of(plan.elements.begin(), plan.elements.end(), [&](const PlanElement& element) {
      return (element.from == i && is_ground(element.to)) || (element.to == i && is_ground(element.from));
    });
    if (!guided) names.push_back(guide_prefix + mass);
  }
  return names;
}

std::vector<std::string> actuators(const Plan& plan) {
  if (plan.inputs.size() == 1) return {"actuator"};
  std::vector<std::string> names;
  for (const PlanInput& input : plan.inputs) names.push_back("actuator:" + input.name);
  return names;
}

std::vector<std::string> timebase(const Plan&) { return {"timebase"}; }

std::vector<std::string> sensor_places(const Plan& plan) {
  std::vector<std::string> names;
  for (const PlanSensor& sensor : plan.sensors) names.push_back("sensor:" + sensor.name);
  return names;
}

namespace {

template <class List, class Name>
Index position(const List& list, const std::string& place, Name name) {
  for (std::size_t i = 0; i < list.size(); ++i)
    if (name(list[i]) == place) return static_cast<Index>(i);
  throw std::logic_error("blind: no place called " + place);
}

}  // namespace

Index element_at(const Plan& plan, const std::string& place) {
  return position(plan.elements, place, [](const PlanElement& e) { return e.name; });
}
Index mass_at(const Plan& plan, const std::string& place) {
  const std::string mass = place.starts_with(guide_prefix) ? place.substr(guide_prefix.size()) : place;
  return position(plan.masses, mass, [](const std::string& name) { return name; });
}
Index input_at(const Plan& plan, const std::string& place) {
  return position(plan.inputs, place, [&](const PlanInput& input) {
    return plan.inputs.size() == 1 ? std::string("actuator") : "actuator:" + input.name;
  });
}
Index sensor_at(const Plan& plan, const std::string& place) {
  return position(plan.sensors, place, [](const PlanSensor& sensor) { return "sensor:" + sensor.name; });
}

const Extent& motion_of(const Surroundings& rig, Index element) {
  return rig.elements[static_cast<std::size_t>(element)];
}

double usual_force(const Surroundings& rig, Index element) {
  const BaseLaws laws = base_laws(*rig.plan, rig.theta, element);
  return laws.stiffness_at_rest() * motion_of(rig, element).rms + laws.damping * motion_of(rig, element).speed_rms;
}

double between(Random& random, double low, double high) { return low + (high - low) * random.uniform(); }
double log_between(Random& random, double low, double high) { return low * std::pow(high / low, random.uniform()); }
double either_sign(Random& random) { return random.uniform() < 0.5 ? -1 : 1; }

}  // namespace wheelhop::blind
