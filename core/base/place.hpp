/// \file
/// Places at which something may be wrong with a plant or its records, and effects at them, typed: their text is read
/// from files and written to files and messages, and nothing in between takes it apart.
#pragma once

#include <fmt/ostream.h>

#include <compare>
#include <iosfwd>
#include <string>
#include <utility>

#include "core/base/json.hpp"

namespace wheelhop {

enum class PlaceKind {
  part,      ///< an element or a mass; in one plant their names differ
  guide,     ///< between the ground and a mass
  sensor,    ///< the path from the plant to a channel of the record
  actuator,  ///< the path from a drive's command to the plant; of the only drive without its name
  timebase   ///< the clock
};

struct Place {
  PlaceKind kind = PlaceKind::part;
  /// Of the part, mass, channel or input; empty for the path of the only drive, the clock, and no place at all.
  std::string name = {};
  bool operator==(const Place&) const = default;
  /// True of no place at all.
  bool empty() const { return kind == PlaceKind::part && name.empty(); }
};

inline Place part_place(std::string part) { return {PlaceKind::part, std::move(part)}; }
inline Place guide_place(std::string mass) { return {PlaceKind::guide, std::move(mass)}; }
inline Place sensor_place(std::string channel) { return {PlaceKind::sensor, std::move(channel)}; }
inline Place clock_place() { return {PlaceKind::timebase, {}}; }

/// Reads "suspension", "guide:wheel", "sensor:travel", "actuator", "actuator:road" or "timebase". Plant files allow no
/// colon in names, and no part that is called "actuator" or "timebase".
Place place_from(const std::string& text);
std::string to_string(const Place& place);
/// In the order of their texts, and of their kinds where a part is called as another place would be.
std::strong_ordering operator<=>(const Place& a, const Place& b);

/// True of a path that signals take, or the clock: no force of the plant.
inline bool is_path(const Place& place) {
  return place.kind == PlaceKind::sensor || place.kind == PlaceKind::actuator || place.kind == PlaceKind::timebase;
}

/// The mass behind a guide, and any other place as it is: a force between the ground and a mass is one on the mass.
Place without_guide(const Place& place);

/// What an effect is called: a family of the catalogue, as "coulomb_friction"; a wrong number of the plant file, as
/// "mass_error"; or "unknown" and "exogenous_force" for what has no family.
class EffectId {
 public:
  EffectId() = default;
  EffectId(const char* text) : text_(text) {}  // a literal names an effect wherever one is asked for
  explicit EffectId(std::string text) : text_(std::move(text)) {}
  const std::string& text() const { return text_; }
  friend auto operator<=>(const EffectId&, const EffectId&) = default;
  friend bool operator==(const EffectId&, const EffectId&) = default;

 private:
  std::string text_;
};

/// An effect at a place: what an answer names. Its text is "EFFECT@PLACE". Ordered by effect, then by place.
struct EffectAt {
  EffectId effect;
  Place place;
  friend auto operator<=>(const EffectAt&, const EffectAt&) = default;
  friend bool operator==(const EffectAt&, const EffectAt&) = default;
};
std::string to_string(const EffectAt& named);

std::ostream& operator<<(std::ostream& out, const Place& place);
std::ostream& operator<<(std::ostream& out, const EffectId& effect);
std::ostream& operator<<(std::ostream& out, const EffectAt& named);

inline void to_json(Json& json, const Place& place) { json = to_string(place); }
inline void to_json(Json& json, const EffectId& effect) { json = effect.text(); }
inline void to_json(Json& json, const EffectAt& named) { json = to_string(named); }

}  // namespace wheelhop

template <>
struct fmt::formatter<wheelhop::Place> : fmt::ostream_formatter {};
template <>
struct fmt::formatter<wheelhop::EffectId> : fmt::ostream_formatter {};
template <>
struct fmt::formatter<wheelhop::EffectAt> : fmt::ostream_formatter {};
