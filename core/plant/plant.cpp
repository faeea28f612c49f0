#include "core/plant/plant.hpp"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "core/base/status.hpp"

namespace wheelhop {
namespace {

std::string joined(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

[[noreturn]] void unknown(const Plant& plant, const std::string& what, std::string_view name,
                          const std::vector<std::string>& known) {
  const std::string near = nearest_name(name, known);
  throw UserError("plant \"" + plant.name + "\": unknown " + what + " \"" + std::string(name) + "\"" +
                  (near.empty() ? "" : ", did you mean \"" + near + "\"?") + " Known: " + joined(known));
}

/// A number of a plant while it is visited: no text is copied.
struct VisitedNumber {
  std::string_view prefix, number;  ///< its name is one after the other
  ParameterOwner owner;
  const Place& place;
  const LawKind* law;
  std::string_view unit;
  double tolerance;
  Range range;

  bool is_called(std::string_view name) const {
    return name.size() == prefix.size() + number.size() && name.starts_with(prefix) && name.ends_with(number);
  }
  PlantParameter parameter(double value) const {
    return {std::string(prefix) + std::string(number),
            {owner, place, law, std::string(number)},
            std::string(unit),
            value,
            tolerance,
            range};
  }
};

/// Calls visit(number, value) for every number of the paths; those that are ideal only if `all`.
template <class AnyPlant, class Visit>
void visit_paths(AnyPlant& plant, bool all, Visit visit) {
  const auto in = [&](ParameterOwner owner, const Place& place, const std::string& prefix) {
    return [&visit, all, owner, &place, &prefix](const char* key, const std::string& unit, auto& value, double ideal,
                                                 Range range) {
      if (all || value != ideal)
        visit(VisitedNumber{prefix, key, owner, place, nullptr, unit, default_tolerance, range}, value);
    };
  };
  for (auto& input : plant.inputs) {
    const Place place = actuator_of(plant, input);
    const std::string prefix = "actuator:" + input.name + ".";
    visit_drive_path(input.path, input.unit, in(ParameterOwner::drive_path, place, prefix));
  }
  for (auto& sensor : plant.sensors) {
    const Place place = sensor_place(sensor.name);
    const std::string prefix = to_string(place) + ".", crosstalk = prefix + "crosstalk.";
    visit_sensor_path(sensor.path, sensor.unit, in(ParameterOwner::sensor_path, place, prefix));
    for (auto& [channel, factor] : sensor.path.crosstalk)
      visit(
          VisitedNumber{crosstalk, channel, ParameterOwner::crosstalk, place, nullptr, "-", default_tolerance, Range{}},
          factor);
  }
  const Place clock = clock_place();
  const std::string prefix = to_string(clock) + ".";
  in(ParameterOwner::clock, clock, prefix)("clock_skew", "-", plant.clock_skew, 0, Range{});
}

std::string unit_of_input(const Plant& plant, const std::string& name) {
  for (const PlantInput& input : plant.inputs)
    if (input.name == name) return input.unit;
  return "-";
}

/// Calls visit(number, value) for every scalar that a fit may move.
template <class AnyPlant, class Visit>
void visit_parameters(AnyPlant& plant, bool ideal_paths, Visit visit) {
  for (auto& mass : plant.masses) {
    const Place place = part_place(mass.name);
    const std::string prefix = mass.name + ".";
    visit(VisitedNumber{prefix, "mass_kg", ParameterOwner::mass, place, nullptr, "kg", mass.tolerance, Range{.low = 0}},
          mass.mass_kg);
  }
  for (auto& element : plant.elements) {
    const Place place = location_of(element);
    for (std::size_t i = 0; i < element.laws.size(); ++i) {
      auto& law = element.laws[i];
      const std::string prefix = law_name(element, i) + ".";
      const std::vector<std::string> names = law.parameter_names();
      for (std::size_t k = 0; k < law.values.size(); ++k) {
        if (!std::isfinite(law.values[k])) continue;  // "none", e.g. no travel limit
        const LawParameter& parameter = law.kind->parameter_of(k);
        visit(VisitedNumber{prefix, names[k], ParameterOwner::law, place, law.kind, parameter.unit, law.tolerance,
                            parameter.range},
              law.values[k]);
      }
      for (auto& [k, slope] : law.schedule.slopes) {
        const std::string number = "scheduled." + names[k];
        const LawParameter& parameter = law.kind->parameter_of(k);
        const std::string unit = parameter.unit + "/" + unit_of_input(plant, law.schedule.by);
        visit(
            VisitedNumber{prefix, number, ParameterOwner::law, place, law.kind, unit, law.schedule.tolerance, Range{}},
            slope);
      }
    }
  }
  for (auto& load : plant.loads) {
    const Place place = location_of(plant, load);
    const std::string prefix = "load:" + load.name + ".";
    visit(VisitedNumber{prefix, "force_n", ParameterOwner::load, place, nullptr, "N", load.tolerance, Range{}},
          load.force_n);
  }
  visit_paths(plant, ideal_paths, visit);
}

std::vector<std::string> parameter_names(const Plant& plant) {
  std::vector<std::string> names;
  for (const PlantParameter& parameter : plant_parameters(plant)) names.push_back(parameter.name);
  return names;
}

bool is_damping(const Law& law, std::size_t k) { return law.kind->parameters[k].name == "damping_ns_per_m"; }

/// The slope of the viscous damper's damping with a schedule that slope number i of a law follows, likewise.
const double* followed_slope(const Element& element, const Law& law, std::size_t i) {
  const auto& [k, slope] = law.schedule.slopes[i];
  if (!law.kind->is_correction || !is_damping(law, k)) return nullptr;
  for (const Law& other : element.laws)
    if (std::string_view(other.kind->name) == "viscous_damper" && other.schedule.by == law.schedule.by &&
        other.schedule.slopes.front().second == slope)
      return &other.schedule.slopes.front().second;
  return nullptr;
}

/// The number of another law of an element that number k of a law follows, as long as both are the same: of what
/// corrects a damper its damping, of what corrects a spring its stiffness. nullptr: none.
const double* followed(const Element& element, const Law& law, std::size_t k) {
  if (law.kind->is_correction && is_damping(law, k))
    for (const Law& other : element.laws)
      if (std::string_view(other.kind->name) == "viscous_damper" && other.values.front() == law.values[k])
        return &other.values.front();
  if (law.kind->corrects_spring && law.kind->parameters[k].name == "stiffness_n_per_m")
    for (const Law& other : element.laws)
      if (const double* stiffness = spring_stiffness(other); stiffness != nullptr && *stiffness == law.values[k])
        return stiffness;
  return nullptr;
}

}  // namespace

const double* spring_stiffness(const Law& law) {
  const std::string_view kind = law.kind->name;
  return kind == "linear_spring" || kind == "hardening_spring" ? &law.values.front() : nullptr;
}

bool turns(const Plant& plant, const std::string& mass) {
  for (const Point& point : plant.points)
    for (const auto& [name, weight] : point.weights)
      if (name == mass && weight < 0) return true;
  return false;
}

std::string law_name(const Element& element, std::size_t law) {
  const LawKind* kind = element.laws[law].kind;
  int occurrence = 1;
  for (std::size_t j = 0; j < law; ++j) occurrence += element.laws[j].kind == kind;
  std::string name = element.name + "." + kind->name;
  if (occurrence > 1) name += fmt::format("[{}]", occurrence);
  return name;
}

std::string guide_element(const std::string& mass) { return "guide_of_" + mass; }

Place location_of(const Element& element) {
  return element.from == "ground" && element.name == guide_element(element.to) ? guide_place(element.to)
                                                                               : part_place(element.name);
}

Place location_of(const Plant& plant, const Load& load) {
  return plant.node(load.on) < plant.mass_count() ? guide_place(load.on) : part_place(load.on);
}

Place actuator_of(const Plant& plant, const PlantInput& input) {
  return {PlaceKind::actuator, plant.inputs.size() == 1 ? "" : input.name};
}

std::vector<std::string> Plant::node_names() const {
  std::vector<std::string> names;
  for (const Mass& mass : masses) names.push_back(mass.name);
  for (const PlantInput& input : inputs)
    if (input.kind == InputKind::displacement) names.push_back(input.name);
  names.push_back("ground");
  for (const Point& point : points) names.push_back(point.name);
  return names;
}

Index Plant::node(std::string_view node_name) const {
  const std::vector<std::string> names = node_names();
  for (std::size_t i = 0; i < names.size(); ++i)
    if (names[i] == node_name) return static_cast<Index>(i);
  unknown(*this, "node", node_name, names);
}

Index Plant::element(std::string_view element_name) const {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < elements.size(); ++i) {
    if (elements[i].name == element_name) return static_cast<Index>(i);
    names.push_back(elements[i].name);
  }
  unknown(*this, "element", element_name, names);
}

double Plant::hold_hz() const {
  if (inputs.empty()) throw UserError("plant \"" + name + "\": expected at least one input");
  for (const PlantInput& input : inputs)
    if (input.hold_hz != inputs.front().hold_hz)
      throw UserError("plant \"" + name + "\": inputs \"" + inputs.front().name + "\" and \"" + input.name +
                      "\" have different hold_hz; all inputs are held at the same instants");
  if (!(inputs.front().hold_hz > 0))
    throw UserError("plant \"" + name + "\": expected \"hold_hz\" in its inputs: without records that were measured, " +
                    "nothing else says how often the drive changes");
  return inputs.front().hold_hz;
}

bool Plant::held() const { return inputs.empty() || inputs.front().held; }

std::vector<Channel> Plant::input_channels() const {
  std::vector<Channel> channels;
  for (const PlantInput& input : inputs) channels.push_back({input.name, input.unit});
  return channels;
}

std::vector<Channel> Plant::output_channels() const {
  std::vector<Channel> channels;
  for (const Sensor& sensor : sensors) channels.push_back({sensor.name, sensor.unit});
  return channels;
}

std::vector<std::string> memory_names(const Plant& plant) {
  std::vector<std::string> names;
  for (const Element& element : plant.elements)
    for (std::size_t i = 0; i < element.laws.size(); ++i)
      for (int k = 1; k <= element.laws[i].states(); ++k)
        names.push_back(fmt::format("{}.z_{}", law_name(element, i), k));
  return names;
}

std::vector<PlantParameter> plant_parameters(const Plant& plant) {
  std::vector<PlantParameter> list;
  visit_parameters(plant, false,
                   [&](const VisitedNumber& number, double value) { list.push_back(number.parameter(value)); });
  // In the same order, and as many of each law.
  std::size_t at = plant.masses.size();
  for (const Element& element : plant.elements)
    for (const Law& law : element.laws) {
      for (std::size_t k = 0; k < law.values.size(); ++k)
        if (std::isfinite(law.values[k])) list[at++].follows = followed(element, law, k) != nullptr;
      for (std::size_t i = 0; i < law.schedule.slopes.size(); ++i)
        list[at++].follows = followed_slope(element, law, i) != nullptr;
    }
  return list;
}

double get_parameter(const Plant& plant, std::string_view name) {
  const double* found = nullptr;
  visit_parameters(plant, true, [&](const VisitedNumber& number, const double& value) {
    if (number.is_called(name)) found = &value;
  });
  if (!found) unknown(plant, "parameter", name, parameter_names(plant));
  return *found;
}

void set_parameter(Plant& plant, std::string_view name, double value) {
  double* found = nullptr;
  visit_parameters(plant, true, [&](const VisitedNumber& number, double& slot) {
    if (number.is_called(name)) found = &slot;
  });
  if (!found) unknown(plant, "parameter", name, parameter_names(plant));
  for (Element& element : plant.elements)
    for (Law& law : element.laws) {
      for (std::size_t k = 0; k < law.values.size(); ++k)
        if (followed(element, law, k) == found) law.values[k] = value;
      for (std::size_t i = 0; i < law.schedule.slopes.size(); ++i)
        if (followed_slope(element, law, i) == found) law.schedule.slopes[i].second = value;
    }
  *found = value;
}

}  // namespace wheelhop
