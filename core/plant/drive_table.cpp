#include <fmt/format.h>

#include <cmath>

#include "core/plant/road.hpp"

namespace wheelhop {
namespace {

struct Generator {
  std::string name, source;
  DriveOptions defaults;
};

const std::vector<Generator>& generators() {
  static const std::vector<Generator> table = {
      {"band_limited_noise", "S. Butterworth 1930, low-pass of white Gaussian noise", BandLimitedNoise{}},
      {"multisine", "R. Pintelon, J. Schoukens, System Identification (2012), random-phase multisine", Multisine{}},
      {"sweep", "sine of moving frequency", Sweep{}},
      {"iso8608", "ISO 8608, road surface profiles", Iso8608{}},
      {"bump", "haversine hump", Bump{}},
      {"steps", "levels of a uniform distribution, each held", Steps{}}};
  return table;
}

[[noreturn]] void fail_at(const JsonCursor& cursor, const char* key, const std::string& expected) {
  if (auto member = cursor.find(key)) member->fail(expected);
  cursor.fail(fmt::format("\"{}\": {}", key, expected));
}

void below_half_rate(const JsonCursor& cursor, const char* key, double frequency_hz, double hold_hz) {
  if (!(frequency_hz < 0.5 * hold_hz))
    fail_at(cursor, key, fmt::format("a frequency below half the hold rate of {} Hz", hold_hz));
}

void check(const BandLimitedNoise& o, const JsonCursor& cursor, double hold_hz) {
  below_half_rate(cursor, "cutoff_hz", o.cutoff_hz, hold_hz);
}

void check(const Multisine& o, const JsonCursor& cursor, double hold_hz) {
  below_half_rate(cursor, "to_hz", o.to_hz, hold_hz);
  const double samples = o.period_s * hold_hz;
  if (samples < 4 || std::abs(samples - std::round(samples)) > 1e-6)
    fail_at(cursor, "period_s", fmt::format("a whole number of hold intervals of 1/{} s", hold_hz));
  if (o.detection_group == 1) fail_at(cursor, "detection_group", "0 or at least 2 (1 would leave every line empty)");
  const double first = std::max(1.0, std::ceil(o.from_hz * o.period_s - 1e-9));
  const double last = std::floor(o.to_hz * o.period_s + 1e-9);
  // Three lines hold an odd one and, in a group of two candidates at least, one that is not left out.
  if (last - first < (o.odd_lines_only ? 3 : 1))
    fail_at(cursor, "to_hz", fmt::format("a band of several lines of 1/{} Hz above \"from_hz\"", o.period_s));
}

void check(const Sweep& o, const JsonCursor& cursor, double hold_hz) {
  below_half_rate(cursor, "from_hz", o.from_hz, hold_hz);
  below_half_rate(cursor, "to_hz", o.to_hz, hold_hz);
}

void check(const Iso8608& o, const JsonCursor& cursor, double hold_hz) {
  if (!(o.to_cycles_per_m > o.from_cycles_per_m))
    fail_at(cursor, "to_cycles_per_m", "a spatial frequency above \"from_cycles_per_m\"");
  below_half_rate(cursor, "to_cycles_per_m", o.to_cycles_per_m * o.speed_m_per_s, hold_hz);
}

void check(const Bump&, const JsonCursor&, double) {}

void check(const Steps& o, const JsonCursor& cursor, double) {
  if (!(o.low <= o.high)) fail_at(cursor, "high", "a level that is not below \"low\"");
}

}  // namespace

std::vector<DriveEntry> drive_table() {
  std::vector<DriveEntry> table;
  for (const Generator& generator : generators())
    table.push_back({generator.name, generator.source,
                     std::visit([](const auto& o) { return describe_options(o); }, generator.defaults)});
  return table;
}

DriveOptions parse_drive(const JsonCursor& cursor, double hold_hz, const std::string& unit) {
  std::vector<std::string> names;
  for (const Generator& generator : generators()) names.push_back(generator.name);
  const std::string name = cursor.at("name").one_of(names);
  for (const Generator& generator : generators()) {
    if (generator.name != name) continue;
    return std::visit(
        [&](const auto& defaults) -> DriveOptions {
          const auto options = read_options(cursor, defaults);
          cursor.done();
          check(options, cursor, hold_hz);
          if (name == "iso8608" && unit != "m")
            cursor.at("name").fail("a drive with a level of its own (a road is in m, this input in " + unit + ")");
          return options;
        },
        generator.defaults);
  }
  cursor.fail("a drive");
}

Json to_json(const DriveOptions& options) {
  Json out = Json::object();
  out["name"] = generators()[options.index()].name;  // the table keeps the order of the variant
  out.update(std::visit([](const auto& o) { return write_options(o); }, options));
  return out;
}

}  // namespace wheelhop
