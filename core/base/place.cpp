#include "core/base/place.hpp"

#include <array>
#include <utility>

namespace wheelhop {
namespace {

constexpr std::array<std::pair<PlaceKind, const char*>, 3> kPrefixes = {
    {{PlaceKind::guide, kGuide}, {PlaceKind::sensor, "sensor:"}, {PlaceKind::actuator, "actuator:"}}};

}  // namespace

Place place_from(const std::string& text) {
  if (text == "actuator") return {PlaceKind::actuator, ""};
  if (text == "timebase") return {PlaceKind::timebase, ""};
  for (const auto& [kind, prefix] : kPrefixes)
    if (text.starts_with(prefix)) return {kind, text.substr(std::string(prefix).size())};
  return {PlaceKind::part, text};
}

std::string without_guide(const std::string& text) {
  const Place place = place_from(text);
  return place.kind == PlaceKind::guide ? place.name : text;
}

std::string to_string(const Place& place) {
  if (place.kind == PlaceKind::timebase) return "timebase";
  if (place.kind == PlaceKind::actuator && place.name.empty()) return "actuator";
  for (const auto& [kind, prefix] : kPrefixes)
    if (place.kind == kind) return prefix + place.name;
  return place.name;
}

}  // namespace wheelhop
