#include "core/plant/rotary.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace wheelhop {
namespace {

/// Ends of names, the longest of those that end alike first.
constexpr std::array<std::pair<std::string_view, std::string_view>, 9> kEnds = {{{"_force_n", "_torque_nm"},
                                                                                 {"_ns_per_m", "_nms_per_rad"},
                                                                                 {"_n_per_m", "_nm_per_rad"},
                                                                                 {"_m_per_s", "_rad_per_s"},
                                                                                 {"_per_m2", "_per_rad2"},
                                                                                 {"_per_m", "_per_rad"},
                                                                                 {"_kg", "_kg_m2"},
                                                                                 {"_m", "_rad"},
                                                                                 {"_n", "_nm"}}};

}  // namespace

std::string rotary_name(std::string_view name) {
  if (name == "mass_kg") return "inertia_kg_m2";
  // The entries of a list are numbered: per_m_1.
  const std::size_t digits = name.find_last_not_of("0123456789");
  const bool numbered = digits != std::string_view::npos && digits + 1 < name.size() && name[digits] == '_';
  const std::string_view stem = numbered ? name.substr(0, digits) : name;
  std::string whole = "_";  // "per_m" ends like "_per_m"
  whole += stem;
  for (const auto& [end, turned] : kEnds)
    if (whole.ends_with(end))
      return (whole.substr(0, whole.size() - end.size()) + std::string(turned)).substr(1) +
             std::string(name.substr(stem.size()));
  return std::string(name);
}

bool is_rotary(const Plant& plant, const std::string& node) {
  for (const Mass& mass : plant.masses)
    if (mass.name == node) return mass.rotary;
  for (const PlantInput& input : plant.inputs)
    if (input.kind == InputKind::displacement && input.name == node) return input.unit == "rad";
  for (const Point& point : plant.points)
    if (point.name == node) return point.rotary;
  return false;
}

bool is_rotary(const Plant& plant, const Element& element) {
  return is_rotary(plant, element.from) || is_rotary(plant, element.to);
}

std::string force_unit(const Plant& plant, const Place& location) {
  bool turns = is_rotary(plant, location.name);
  for (const Element& element : plant.elements)
    turns = turns || (element.name == location.name && is_rotary(plant, element));
  return turns ? "N m" : "N";
}

std::string motion_unit(const Plant& plant, const std::string& variable) {
  const std::string name = variable.substr(0, variable.rfind('.'));
  const bool turns = std::any_of(plant.elements.begin(), plant.elements.end(), [&](const Element& element) {
    return element.name == name && is_rotary(plant, element);
  });
  return std::string(turns ? "rad" : "m") + (variable.ends_with("velocity") ? "/s" : "");
}

std::string shown_name(const Plant& plant, const std::string& parameter) {
  for (const PlantParameter& known : plant_parameters(plant)) {
    if (known.name != parameter) continue;
    const ParameterHandle& handle = known.handle;
    const bool force = handle.owner == ParameterOwner::mass || handle.owner == ParameterOwner::law ||
                       handle.owner == ParameterOwner::load;
    if (!force || force_unit(plant, handle.place) == "N") break;
    return parameter.substr(0, parameter.size() - handle.number.size()) + rotary_name(handle.number);
  }
  return parameter;
}

}  // namespace wheelhop
