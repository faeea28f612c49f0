#include "experiments/sweep/grid.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <limits>

#include "core/base/files.hpp"
#include "core/base/status.hpp"
#include "experiments/sweep/axes.hpp"

namespace wheelhop {
namespace {

/// The base experiment as JSON that names no file. @param directory of what it names
Json read_base(const JsonCursor& cursor, std::string& source) {
  Json base = cursor.raw();
  std::filesystem::path directory = cursor.directory();
  source = cursor.where();
  if (cursor.is_string()) {
    const std::filesystem::path file = directory / cursor.string();
    source = file.string();
    directory = file.parent_path();
    base = parse_json(read_file(file), source);
  }
  if (!base.is_object()) cursor.fail("the config of an experiment, or the file that holds one");
  base.erase("as_printed");
  if (base.contains("plant") && base["plant"].is_string()) {
    const std::filesystem::path file = directory / base["plant"].get<std::string>();
    base["plant"] = parse_json(read_file(file), file.string());
  }
  return base;
}

ExperimentConfig parse(Json config, const std::string& where) {
  const JsonCursor cursor = JsonCursor::from(std::move(config), where);
  ExperimentConfig result = parse_experiment_config(cursor);
  cursor.done();
  return result;
}

/// One rule of `exclude`: positions on each axis that it names; an empty list stands for an axis it does not name.
using Rule = std::vector<std::vector<std::size_t>>;

std::vector<Rule> read_rules(const JsonCursor& list, const Grid& grid) {
  std::vector<std::string> names;
  for (const Axis& axis : grid.axes) names.push_back(axis.name);
  std::vector<Rule> rules;
  for (const JsonCursor& item : list.items()) {
    if (!item.is_object() || item.raw().empty()) item.fail("an object of axes and the values to leave out");
    Rule rule(grid.axes.size());
    for (const auto& [name, wanted] : item.raw().items()) {
      const JsonCursor member = item.at(name);
      const Index axis = grid.axis_called(name);
      if (axis < 0)
        throw UserError(fmt::format("{}: no axis is called so; axes: {}", member.where(), join_names(names)));
      const Axis& known = grid.axes[static_cast<std::size_t>(axis)];
      for (const Json& value : wanted.is_array() ? wanted : Json::array({wanted})) {
        const std::string label = value.is_string() ? value.get<std::string>() : value.dump();
        const auto at = std::find(known.labels.begin(), known.labels.end(), label);
        if (at == known.labels.end()) member.fail("one of " + join_names(known.labels));
        rule[static_cast<std::size_t>(axis)].push_back(static_cast<std::size_t>(at - known.labels.begin()));
      }
    }
    rules.push_back(std::move(rule));
  }
  return rules;
}

bool leaves_out(const Rule& rule, const std::vector<std::size_t>& at) {
  for (std::size_t i = 0; i < at.size(); ++i)
    if (!rule[i].empty() && std::find(rule[i].begin(), rule[i].end(), at[i]) == rule[i].end()) return false;
  return true;
}

Until read_until(const JsonCursor& cursor, const Grid& grid) {
  for (const char* required : {"over", "at_most"}) cursor.at(required);
  auto until = read_options<Until>(cursor);
  std::vector<std::string> names;
  for (const Axis& axis : grid.axes) names.push_back(axis.name);
  cursor.at("over").one_of(names);
  if (grid.axes[static_cast<std::size_t>(grid.axis_called(until.over))].labels.size() < 2)
    cursor.at("over").fail("an axis of at least two values to compare");
  if (until.at_most < grid.realisations)
    cursor.at("at_most").fail(fmt::format("a number from the {} of `realisations` on", grid.realisations));
  cursor.done();
  return until;
}

Json cell_json(const Grid& grid, const std::vector<std::size_t>& at, const std::string& where) {
  Json config = grid.config["base"];
  for (std::size_t i = 0; i < at.size(); ++i)
    for (const auto& [path, wanted] : grid.sets[i][at[i]].items()) set_path(config, path, wanted, where);
  return config;
}

std::string name_of_cell(const Grid& grid, const std::vector<std::size_t>& at, const std::string& source) {
  std::string where = source + ": $.axes (";
  for (std::size_t i = 0; i < at.size(); ++i)
    where += fmt::format("{}{} = {}", i == 0 ? "" : ", ", grid.axes[i].name, grid.axes[i].labels[at[i]]);
  return where + ")";
}

/// Checks a cell's config and describes it.
Cell make_cell(const Grid& grid, std::vector<std::size_t> at, const std::string& source) {
  const std::string where = name_of_cell(grid, at, source);
  const ExperimentConfig config = parse(cell_json(grid, at, where), where);
  Json hashed = {{"measure", grid.effective["measure"]}, {"experiment", config.effective}};
  hashed["experiment"].erase("realisations");  // a row has its own
  if (grid.measure == Measure::solver) {
    hashed["evaluations"] = grid.evaluations;
    hashed["preparation"] = grid.base.effective;
  }
  Cell cell{std::move(at), hash_of(hashed.dump()), Json::object()};
  for (const auto& [key, value] : config.effective.items())
    if (!grid.base.effective.contains(key) || grid.base.effective[key] != value) cell.beside_base[key] = value;
  return cell;
}

}  // namespace

std::string hash_of(const std::string& text) {
  std::uint64_t hash = 0xcbf29ce484222325;
  for (const char letter : text) hash = (hash ^ static_cast<unsigned char>(letter)) * 0x100000001b3;
  return fmt::format("{:016x}", hash);
}

std::string row_hash(const Grid& grid, std::size_t cell, Index realisation) {
  return hash_of(fmt::format("{} {}", grid.cells[cell].hash, realisation));
}

Index Grid::axis_called(const std::string& name) const {
  for (std::size_t i = 0; i < axes.size(); ++i)
    if (axes[i].name == name) return static_cast<Index>(i);
  return -1;
}

ExperimentConfig Grid::config_of(std::size_t cell) const {
  const std::string where = name_of_cell(*this, cells[cell].at, "sweep");
  return parse(cell_json(*this, cells[cell].at, where), where);
}

Grid read_grid(const std::filesystem::path& file) {
  return read_grid(parse_json(read_file(file), file.string()), file.string(), file.parent_path());
}

Grid read_grid(Json config, const std::string& source, const std::filesystem::path& directory) {
  const JsonCursor cursor = JsonCursor::from(std::move(config), source, directory);
  Grid grid;
  std::string base_source;
  Json base = read_base(cursor.at("base"), base_source);
  grid.base = parse(base, base_source);
  cursor.at("measure");
  const auto options = read_options<SweepOptions>(cursor);
  const std::string& measure = options.measure;
  grid.measure = static_cast<Measure>(std::find(kMeasures.begin(), kMeasures.end(), measure) - kMeasures.begin());
  grid.realisations = options.realisations;
  grid.evaluations = options.evaluations;
  const std::vector<AxisGroup> groups = read_axes(cursor.at("axes"));
  for (std::size_t g = 0; g < groups.size(); ++g)
    for (const AxisSpec& axis : groups[g]) {
      grid.axes.push_back({axis.name, {}, {}, g});
      grid.sets.emplace_back();
      for (const AxisValue& value : axis.values) {
        grid.axes.back().labels.push_back(value.label);
        grid.axes.back().values.push_back(value.column);
        grid.sets.back().push_back(value.set);
      }
    }
  std::vector<Rule> rules;
  const auto exclude = cursor.find("exclude");
  if (exclude) rules = read_rules(*exclude, grid);
  const auto until = cursor.find("until");
  if (until) grid.until = read_until(*until, grid);
  cursor.done();

  grid.config = {{"base", std::move(base)}, {"measure", measure}, {"realisations", grid.realisations}};
  grid.effective = {{"measure", measure}, {"realisations", grid.realisations}};
  if (grid.measure == Measure::solver) grid.config["evaluations"] = grid.effective["evaluations"] = grid.evaluations;
  grid.config["axes"] = write_axes(groups);
  for (const Axis& axis : grid.axes) {
    grid.effective["axes"].push_back({{"name", axis.name}, {"labels", axis.labels}});
    if (groups[axis.group].size() > 1) grid.effective["axes"].back()["zip"] = axis.group;
  }
  if (exclude) grid.config["exclude"] = grid.effective["exclude"] = exclude->raw();
  if (until) grid.config["until"] = grid.effective["until"] = write_options(*grid.until);
  grid.effective["base"] = grid.base.effective;

  std::vector<std::size_t> at(groups.size(), 0);
  for (bool more = true; more;) {
    std::vector<std::size_t> position;
    for (const Axis& axis : grid.axes) position.push_back(at[axis.group]);
    const bool out =
        std::any_of(rules.begin(), rules.end(), [&](const Rule& rule) { return leaves_out(rule, position); });
    if (out)
      ++grid.excluded;
    else
      grid.cells.push_back(make_cell(grid, std::move(position), source));
    more = false;
    for (std::size_t g = groups.size(); g-- > 0 && !more;) {
      more = ++at[g] < groups[g].front().values.size();
      if (!more) at[g] = 0;
    }
  }
  if (grid.cells.empty()) exclude->fail("rules that leave at least one cell");
  return grid;
}

}  // namespace wheelhop
