#include "core/plant/schedule.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace wheelhop {
namespace {

/// The drive that a law follows, null where the plant has none of that name: the law is as if it were 0 then.
const PlantInput* drive_of(const Plant& plant, const Law& law) {
  for (const PlantInput& input : plant.inputs)
    if (law.scheduled() && input.name == law.schedule.by) return &input;
  return nullptr;
}

/// Empty, or what is wrong with the numbers of a law.
std::string fault_of(const Law& law) {
  const std::vector<std::string> names = law.parameter_names();
  for (std::size_t k = 0; k < law.values.size(); ++k) {
    if (!std::isfinite(law.values[k])) continue;  // "none"
    const Range range = law.kind->parameters[law.kind->parameters.front().is_list ? 0 : k].range;
    if (law.values[k] < range.low || law.values[k] > range.high)
      return fmt::format("{} would be {:.4g} where it has to be a {}", names[k], law.values[k], to_string(range));
  }
  return law.kind->check ? law.kind->check(law.values) : "";
}

}  // namespace

double within_range(Range range, double u) { return std::clamp(u, range.low, range.high); }

Law law_at(const Law& law, double u) {
  Law there = law;
  there.schedule = {};
  for (const auto& [k, slope] : law.schedule.slopes) there.values[k] += slope * u;
  return there;
}

bool has_schedules(const Plant& plant) {
  return std::any_of(plant.elements.begin(), plant.elements.end(), [](const Element& element) {
    return std::any_of(element.laws.begin(), element.laws.end(), [](const Law& law) { return law.scheduled(); });
  });
}

Plant at_end_of_schedules(const Plant& plant, bool high) {
  Plant there = plant;
  for (Element& element : there.elements)
    for (Law& law : element.laws) {
      const PlantInput* drive = drive_of(plant, law);
      law = law_at(law, !drive ? 0 : high ? drive->range.high : drive->range.low);
    }
  return there;
}

std::string leaves_range(const Plant& plant) {
  for (const Element& element : plant.elements)
    for (std::size_t i = 0; i < element.laws.size(); ++i) {
      const Law& law = element.laws[i];
      const PlantInput* drive = drive_of(plant, law);
      if (!drive) continue;
      for (const double end : {drive->range.low, drive->range.high})
        if (const std::string fault = fault_of(law_at(law, end)); !fault.empty())
          return fmt::format("{}: at {} = {:.4g} {}, {}", law_name(element, i), drive->name, end, drive->unit, fault);
    }
  return "";
}

}  // namespace wheelhop
