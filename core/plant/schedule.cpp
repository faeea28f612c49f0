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
    const Range range = law.kind->parameter_of(k).range;
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

std::vector<Plant> at_ends_of_schedules(const Plant& plant) {
  std::vector<Plant> ends(1, plant);
  for (const PlantInput& input : plant.inputs) {
    std::vector<Plant> further;
    for (const Plant& there : ends)
      for (const double end : {input.range.low, input.range.high}) {
        if (input.moves()) continue;
        Plant& own = further.emplace_back(there);
        for (Element& element : own.elements)
          for (Law& law : element.laws)
            if (law.schedule.by == input.name) law = law_at(law, end);
      }
    if (!further.empty()) ends = std::move(further);
  }
  return ends;
}

std::string schedule_fault(const Plant& plant) {
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
