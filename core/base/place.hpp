/// \file
/// Places at which something may be wrong with a plant or its records, typed; their text stands in files alone.
#pragma once

#include <string>

namespace wheelhop {

/// What stands before a mass in the text of the place between the ground and it.
inline constexpr const char* kGuide = "guide:";

enum class PlaceKind {
  part,      ///< an element or a mass; in one plant their names differ
  guide,     ///< between the ground and a mass
  sensor,    ///< the path from the plant to a channel of the record
  actuator,  ///< the path from a drive's command to the plant; of the only drive without its name
  timebase   ///< the clock
};

struct Place {
  PlaceKind kind = PlaceKind::part;
  std::string name;  ///< of the part, mass, channel or input; empty for the only drive's path and the clock
  bool operator==(const Place&) const = default;
};

/// Reads "suspension", "guide:wheel", "sensor:travel", "actuator", "actuator:road" or "timebase". Plant files allow no
/// colon in names, and no part that is called "actuator" or "timebase".
Place place_from(const std::string& text);
std::string to_string(const Place& place);

/// True of a path that signals take, or the clock: no force of the plant.
inline bool is_path(const Place& place) {
  return place.kind == PlaceKind::sensor || place.kind == PlaceKind::actuator || place.kind == PlaceKind::timebase;
}

/// The mass behind a guide's text, and any other text as it is: a force between the ground and a mass is one on the
/// mass.
std::string without_guide(const std::string& text);

}  // namespace wheelhop
