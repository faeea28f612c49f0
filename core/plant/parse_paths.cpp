#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>

#include "core/plant/plant.hpp"

namespace wheelhop {
namespace {

constexpr std::string_view lag_prefix = "lag.";

/// Assigns what the file gives; keys of the lag are members of their own object.
struct Reader {
  const JsonCursor& cursor;
  std::optional<JsonCursor> lag;
  void operator()(std::string_view key, const std::string&, double& value, double ideal, Range range) const {
    const bool of_lag = key.starts_with(lag_prefix);
    if (of_lag && !lag) return;
    const auto member = of_lag ? lag->find(key.substr(lag_prefix.size())) : cursor.find(key);
    if (!member) return;
    // A number outside of a lag may be given as its ideal, though a fit would end before it.
    value = !of_lag && member->raw() == ideal ? ideal : member->number(range);
  }
};

Reader reader(const JsonCursor& cursor) {
  Reader result{cursor, cursor.find("lag")};
  if (result.lag && result.lag->has("time_constant_s") == result.lag->has("cutoff_hz"))
    result.lag->fail("either \"time_constant_s\" or \"cutoff_hz\" (with \"damping_ratio\")");
  if (result.lag && result.lag->has("time_constant_s") && result.lag->has("damping_ratio"))
    result.lag->at("damping_ratio").fail("no damping ratio beside \"time_constant_s\"");
  return result;
}

struct Writer {
  Json& out;
  bool second_order;
  void operator()(std::string_view key, const std::string&, double value, double ideal, Range) const {
    const bool of_lag = key.starts_with(lag_prefix);
    const bool damping = key == "lag.damping_ratio";
    if (damping ? !second_order : value == ideal) return;
    if (of_lag)
      out["lag"][std::string(key.substr(lag_prefix.size()))] = value;
    else
      out[std::string(key)] = value;
  }
};

}  // namespace

DrivePath parse_drive_path(const JsonCursor& cursor) {
  DrivePath path;
  const Reader read = reader(cursor);
  visit_drive_path(path, "", read);
  if (read.lag) read.lag->done();
  return path;
}

SensorPath parse_sensor_path(const JsonCursor& cursor) {
  SensorPath path;
  const Reader read = reader(cursor);
  visit_sensor_path(path, "", read);
  if (read.lag) read.lag->done();
  if (const auto crosstalk = cursor.find("crosstalk")) {
    if (!crosstalk->is_object()) crosstalk->fail("an object of channel names and factors");
    for (const auto& [channel, factor] : crosstalk->raw().items())
      path.crosstalk.emplace_back(channel, crosstalk->at(channel).number());
  }
  return path;
}

void check_crosstalk(const JsonCursor& sensors, const Plant& plant) {
  const std::vector<JsonCursor> items = sensors.items();
  for (std::size_t i = 0; i < plant.sensors.size(); ++i) {
    std::vector<std::string> others;
    for (const Sensor& sensor : plant.sensors)
      if (sensor.name != plant.sensors[i].name) others.push_back(sensor.name);
    for (const auto& [channel, factor] : plant.sensors[i].path.crosstalk)
      if (std::find(others.begin(), others.end(), channel) == others.end())
        items[i].at("crosstalk").at(channel).fail("the name of another sensor (known: " + join_names(others) + ")");
  }
}

void write_path(Json& out, const DrivePath& path) {
  visit_drive_path(path, "", Writer{out, std::isfinite(path.lag.cutoff_hz)});
}

void write_path(Json& out, const SensorPath& path) {
  visit_sensor_path(path, "", Writer{out, std::isfinite(path.lag.cutoff_hz)});
  for (const auto& [channel, factor] : path.crosstalk) out["crosstalk"][channel] = factor;
}

}  // namespace wheelhop
