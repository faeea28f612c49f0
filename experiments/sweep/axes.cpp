#include "experiments/sweep/axes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "core/base/files.hpp"
#include "core/base/status.hpp"
#include "experiments/sweep/cell.hpp"
#include "experiments/sweep/grid.hpp"
#include "variants/table.hpp"

namespace wheelhop {
namespace {

std::string label_of(const Json& value) {
  if (value.is_string()) return value.get<std::string>();
  if (value.is_object() && value.contains("name") && value["name"].is_string()) return value["name"].get<std::string>();
  return value.dump();
}

AxisValue bare(const std::string& axis, const Json& value) {
  AxisValue result{label_of(value), Json(), Json::object()};
  result.column = value.is_number() || value.is_boolean() ? value : Json(result.label);
  result.set[axis] = value;
  return result;
}

AxisValue read_value(const JsonCursor& cursor, const std::string& axis) {
  if (!cursor.is_object() || !cursor.has("set")) return bare(axis, cursor.raw());
  AxisValue value;
  const JsonCursor set = cursor.at("set");
  if (!set.is_object()) set.fail("an object of paths and values");
  value.set = set.raw();
  value.label = cursor.at("label").string();
  value.column = value.label;
  if (const auto column = cursor.find("column")) {
    if (!column->raw().is_primitive()) column->fail("a number or text");
    value.column = column->raw();
  }
  cursor.done();
  return value;
}

/// A file name in place of a plant becomes the plant, so that the grid names no file.
void read_plants(AxisValue& value, const JsonCursor& cursor) {
  for (auto& [path, wanted] : value.set.items())
    if (path == "plant" && wanted.is_string()) {
      const std::filesystem::path file = cursor.directory() / wanted.get<std::string>();
      wanted = parse_json(read_file(file), file.string());
    }
}

/// Names that an axis may not have: columns of rows, and members of a cell of the table.
bool is_reserved(const std::string& name) {
  static const std::set<std::string> of_a_cell = {"n", "n_ok", "failures", "columns", "config_beside_base"};
  return (is_row_column(name) && name != "seed") || of_a_cell.contains(name) ||
         name.ends_with("_within_1_percent_of_best");
}

/// The number nearest to `value` of at most 15 decimal digits: 0.3 for 0.1 + 2 * 0.1.
double rounded(double value) { return std::stod(fmt::format("{:.15g}", value)); }

std::vector<AxisValue> read_range(const JsonCursor& item, const std::string& axis) {
  const double from = item.at("from").number(), to = item.at("to").number();
  std::vector<double> numbers;
  if (const auto step = item.find("step")) {
    const double by = step->number();
    const double count = by != 0 ? std::floor((to - from) / by * (1 + 1e-12) + 1e-9) + 1 : 0;
    if (!(count >= 1)) step->fail("a step that leads from `from` to `to`");
    if (count > static_cast<double>(kMostCells))
      step->fail(fmt::format("a step that makes at most {} values", kMostCells));
    for (Index i = 0; i < static_cast<Index>(count); ++i)
      numbers.push_back(rounded(from + static_cast<double>(i) * by));
  } else {
    const Index count = item.integer("count", 0, 2, static_cast<Index>(kMostCells));
    const auto spacing = item.find("spacing");
    const bool logarithmic = spacing && spacing->one_of({"linear", "logarithmic"}) == "logarithmic";
    if (logarithmic && !(from > 0 && to > 0)) item.at("from").fail("ends above zero of a logarithmic range");
    for (Index i = 0; i < count; ++i) {
      const double t = static_cast<double>(i) / static_cast<double>(count - 1);
      numbers.push_back(i == 0 ? from
                        : i == count - 1
                            ? to
                            : rounded(logarithmic ? from * std::pow(to / from, t) : from + t * (to - from)));
    }
  }
  std::vector<AxisValue> values;
  for (const double number : numbers) {
    const bool whole = std::abs(number) < 1e15 && number == std::round(number);
    values.push_back(bare(axis, whole ? Json(static_cast<Index>(number)) : Json(number)));
  }
  return values;
}

template <class Piece>
AxisSpec every_piece(const std::string& family, const std::vector<Entry<Piece>>& table) {
  AxisSpec axis{family, {}};
  for (const Entry<Piece>& entry : table)
    if (entry.unavailable().empty()) axis.values.push_back(bare(family, {{"name", entry.name}}));
  return axis;
}

AxisSpec numbers(const std::string& name, const std::vector<int>& values) {
  AxisSpec axis{name, {}};
  for (const int value : values) axis.values.push_back(bare(name, value));
  return axis;
}

struct Preset {
  const char *name, *meaning;
  AxisSpec (*axis)();
};

const std::vector<Preset>& preset_table() {
  static const std::vector<Preset> table = {
      {"noise", "snr_db from 60 to 10 dB by 10",
       [] {
         return numbers("snr_db", {60, 50, 40, 30, 20, 10});
       }},
      {"record_length", "estimation_s 15, 30, 60, 120 s",
       [] {
         return numbers("estimation_s", {15, 30, 60, 120});
       }},
      {"subspace", "every subspace method with its defaults", [] { return every_piece("subspace", subspace_table()); }},
      {"inversion", "every inversion with its defaults", [] { return every_piece("inversion", inversion_table()); }},
      {"nonlinearity", "every static map with its defaults",
       [] { return every_piece("nonlinearity", nonlinearity_table()); }},
      {"solver", "every solver with its defaults", [] { return every_piece("solver", solver_table()); }}};
  return table;
}

AxisSpec read_axis(const JsonCursor& item) {
  if (const auto preset = item.find("preset")) {
    std::vector<std::string> known;
    for (const Preset& one : preset_table()) known.push_back(one.name);
    const std::string name = preset->one_of(known);
    item.done();
    for (const Preset& one : preset_table())
      if (one.name == name) return one.axis();
  }
  AxisSpec axis{item.at("name").string(), {}};
  if (is_reserved(axis.name)) item.at("name").fail("a name that is no column of the results");
  if (item.has("from")) {
    axis.values = read_range(item, axis.name);
  } else {
    for (const JsonCursor& value : item.at("values").items()) {
      axis.values.push_back(read_value(value, axis.name));
      read_plants(axis.values.back(), value);
    }
    if (axis.values.empty()) item.at("values").fail("at least one value");
  }
  std::set<std::string> labels;
  for (std::size_t i = 0; i < axis.values.size(); ++i) {
    if (labels.insert(axis.values[i].label).second) continue;
    const std::string wanted = fmt::format("values whose labels differ (\"{}\" stands twice)", axis.values[i].label);
    if (item.has("from")) item.at("to").fail(wanted);
    item.at("values").items()[i].fail(wanted);
  }
  item.done();
  return axis;
}

AxisGroup read_group(const JsonCursor& item) {
  const auto zip = item.find("zip");
  if (!zip) return {read_axis(item)};
  AxisGroup group;
  for (const JsonCursor& one : zip->items()) {
    group.push_back(read_axis(one));
    if (group.back().values.size() != group.front().values.size())
      one.fail(fmt::format("as many values as the first axis of the zip has, {}", group.front().values.size()));
  }
  if (group.empty()) zip->fail("at least one axis");
  item.done();
  return group;
}

}  // namespace

std::vector<std::pair<std::string, std::string>> presets() {
  std::vector<std::pair<std::string, std::string>> list;
  for (const Preset& one : preset_table()) list.emplace_back(one.name, one.meaning);
  return list;
}

std::vector<AxisGroup> read_axes(const JsonCursor& list) {
  std::vector<AxisGroup> groups;
  std::vector<std::string> names;
  std::size_t cells = 1;
  for (const JsonCursor& item : list.items()) {
    groups.push_back(read_group(item));
    for (const AxisSpec& axis : groups.back()) {
      if (std::find(names.begin(), names.end(), axis.name) != names.end())
        item.fail("a name that no other axis has (\"" + axis.name + "\" stands twice)");
      names.push_back(axis.name);
    }
    cells *= groups.back().front().values.size();
    if (cells > kMostCells) list.fail(fmt::format("at most {} cells", kMostCells));
  }
  if (groups.empty()) list.fail("at least one axis");
  return groups;
}

Json write_axes(const std::vector<AxisGroup>& groups) {
  Json list = Json::array();
  for (const AxisGroup& group : groups) {
    Json zip = Json::array();
    for (const AxisSpec& axis : group) {
      Json values = Json::array();
      for (const AxisValue& value : axis.values)
        values.push_back({{"label", value.label}, {"column", value.column}, {"set", value.set}});
      zip.push_back({{"name", axis.name}, {"values", std::move(values)}});
    }
    list.push_back(group.size() == 1 ? std::move(zip[0]) : Json{{"zip", std::move(zip)}});
  }
  return list;
}

void set_path(Json& config, const std::string& path, const Json& value, const std::string& where) {
  const std::string parameters = "plant_parameters.";
  Json* at = &config;
  std::size_t from = 0;
  for (std::size_t dot; (dot = path.find('.', from)) != std::string::npos; from = dot + 1) {
    if (from == parameters.size() && path.starts_with(parameters)) break;
    at = &(*at)[path.substr(from, dot - from)];
    if (at->is_null()) *at = Json::object();
    if (!at->is_object())
      throw UserError(fmt::format("{}: \"{}\" leads through \"{}\", which is no object in the base config", where, path,
                                  path.substr(0, dot)));
  }
  (*at)[path.substr(from)] = value;
}

}  // namespace wheelhop
