#include "experiments/sweep/grid.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <map>

namespace wheelhop {
namespace {

constexpr std::size_t kMostCells = 100000;

const std::vector<std::string> kMeasures = {"linear", "inversion", "nonlinear", "refined", "solver"};

/// One value of an axis: its label and what it sets, path by path.
struct Value {
  std::string label;
  std::map<std::string, Json> set;
};

std::string label_of(const Json& value) {
  if (value.is_string()) return value.get<std::string>();
  if (value.is_object() && value.contains("name") && value["name"].is_string()) return value["name"].get<std::string>();
  return value.dump();
}

Value read_value(const JsonCursor& cursor, const std::string& axis) {
  Value value;
  if (cursor.is_object() && cursor.has("set")) {
    const JsonCursor set = cursor.at("set");
    if (!set.is_object()) set.fail("an object of paths and values");
    for (const auto& [path, wanted] : set.raw().items()) value.set[path] = wanted;
    value.label = cursor.at("label").string();
    cursor.done();
  } else {
    value.set[axis] = cursor.raw();
    value.label = label_of(cursor.raw());
  }
  return value;
}

/// Columns of rows and tables that an axis may not be called.
bool is_reserved(const std::string& name) {
  static const std::vector<std::string> words = {
      "cell",           "realisation", "config_hash",        "status", "message", "n",           "n_ok",
      "failures",       "columns",     "config_beside_base", "order",  "gap",     "instruments", "map",
      "map_parameters", "stabilised",  "best_pass"};
  return std::find(words.begin(), words.end(), name) != words.end();
}

/// Sets config[a][b] for the path "a.b". @param where for messages
void set_path(Json& config, const std::string& path, const Json& value, const std::string& where) {
  Json* at = &config;
  std::size_t from = 0;
  for (std::size_t dot; (dot = path.find('.', from)) != std::string::npos; from = dot + 1) {
    at = &(*at)[path.substr(from, dot - from)];
    if (at->is_null()) *at = Json::object();
    if (!at->is_object())
      throw UserError(fmt::format("{}: \"{}\" leads through \"{}\", which is no object in the base config", where, path,
                                  path.substr(0, dot)));
  }
  (*at)[path.substr(from)] = value;
}

/// FNV-1a, 64 bits (Fowler, Noll & Vo), as 16 hexadecimal digits.
std::string hash_of(const std::string& text) {
  std::uint64_t hash = 0xcbf29ce484222325;
  for (const char letter : text) hash = (hash ^ static_cast<unsigned char>(letter)) * 0x100000001b3;
  return fmt::format("{:016x}", hash);
}

std::vector<std::vector<Value>> read_axes(const JsonCursor& list, std::vector<Axis>& axes) {
  std::vector<std::vector<Value>> all;
  std::size_t cells = 1;
  for (const JsonCursor& item : list.items()) {
    const std::string name = item.at("name").string();
    for (const Axis& other : axes)
      if (other.name == name) item.at("name").fail("a name that no other axis has");
    if (is_reserved(name)) item.at("name").fail("a name that is no column of the results");
    std::vector<Value> values;
    std::vector<std::string> labels;
    for (const JsonCursor& value : item.at("values").items()) {
      values.push_back(read_value(value, name));
      for (const std::string& other : labels)
        if (other == values.back().label) value.fail("a value whose label no other value of the axis has");
      labels.push_back(values.back().label);
    }
    if (values.empty()) item.at("values").fail("at least one value");
    item.done();
    cells *= values.size();
    if (cells > kMostCells) list.fail(fmt::format("at most {} cells", kMostCells));
    axes.push_back({name, labels});
    all.push_back(std::move(values));
  }
  if (all.empty()) list.fail("at least one axis");
  return all;
}

}  // namespace

Grid read_grid(const std::filesystem::path& file) {
  const JsonCursor cursor = JsonCursor::load(file);
  Grid grid;
  const std::filesystem::path base_file = cursor.directory() / cursor.at("base").string();
  const JsonCursor base = JsonCursor::load(base_file);
  grid.base = parse_reproduce_config(base);
  const std::string measure = cursor.at("measure").one_of(kMeasures);
  grid.measure = static_cast<Measure>(std::find(kMeasures.begin(), kMeasures.end(), measure) - kMeasures.begin());
  grid.realisations = cursor.integer("realisations", grid.realisations, 1, 1000000);
  grid.evaluations = cursor.integer("evaluations", grid.evaluations, 1, 100000000);
  const std::vector<std::vector<Value>> values = read_axes(cursor.at("axes"), grid.axes);
  cursor.done();
  grid.effective = {{"measure", measure}, {"realisations", grid.realisations}};
  if (grid.measure == Measure::solver) grid.effective["evaluations"] = grid.evaluations;
  for (const Axis& axis : grid.axes) grid.effective["axes"].push_back({{"name", axis.name}, {"labels", axis.labels}});
  grid.effective["base"] = grid.base.effective;

  std::vector<std::size_t> at(values.size(), 0);
  for (bool more = true; more;) {
    Cell cell;
    Json config = base.raw();
    std::string where = file.string() + ": $.axes";
    for (std::size_t i = 0; i < values.size(); ++i) {
      const Value& value = values[i][at[i]];
      cell.labels.push_back(value.label);
      where += fmt::format("{}{} = {}", i == 0 ? " (" : ", ", grid.axes[i].name, value.label);
      for (const auto& [path, wanted] : value.set) set_path(config, path, wanted, where + ")");
    }
    cell.config = parse_reproduce_config(JsonCursor::from(std::move(config), where + ")", base.directory()));
    cell.hash = hash_of(grid.effective.dump() + cell.config.effective.dump());
    grid.cells.push_back(std::move(cell));
    more = false;
    for (std::size_t i = values.size(); i-- > 0 && !more;) {
      more = ++at[i] < values[i].size();
      if (!more) at[i] = 0;
    }
  }
  return grid;
}

}  // namespace wheelhop
