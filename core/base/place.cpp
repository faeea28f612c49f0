#include "core/base/place.hpp"

#include <array>
#include <ostream>
#include <string_view>

namespace wheelhop {
namespace {

constexpr std::array<std::pair<PlaceKind, std::string_view>, 3> kPrefixes = {
    {{PlaceKind::guide, "guide:"}, {PlaceKind::sensor, "sensor:"}, {PlaceKind::actuator, "actuator:"}}};

}  // namespace

Place place_from(const std::string& text) {
  if (text == "actuator") return {PlaceKind::actuator, ""};
  if (text == "timebase") return clock_place();
  for (const auto& [kind, prefix] : kPrefixes)
    if (text.starts_with(prefix)) return {kind, text.substr(prefix.size())};
  return part_place(text);
}

std::string to_string(const Place& place) {
  if (place.kind == PlaceKind::timebase) return "timebase";
  if (place.kind == PlaceKind::actuator && place.name.empty()) return "actuator";
  for (const auto& [kind, prefix] : kPrefixes)
    if (place.kind == kind) return std::string(prefix) + place.name;
  return place.name;
}

std::strong_ordering operator<=>(const Place& a, const Place& b) {
  const std::strong_ordering texts = to_string(a) <=> to_string(b);
  return texts == 0 ? a.kind <=> b.kind : texts;
}

Place without_guide(const Place& place) { return place.kind == PlaceKind::guide ? part_place(place.name) : place; }

std::string to_string(const EffectAt& named) { return named.effect.text() + "@" + to_string(named.place); }

std::ostream& operator<<(std::ostream& out, const Place& place) { return out << to_string(place); }
std::ostream& operator<<(std::ostream& out, const EffectId& effect) { return out << effect.text(); }
std::ostream& operator<<(std::ostream& out, const EffectAt& named) { return out << to_string(named); }

}  // namespace wheelhop
