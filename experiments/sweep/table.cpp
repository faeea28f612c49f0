#include "experiments/sweep/table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>

#include "core/base/files.hpp"
#include "core/base/status.hpp"
#include "experiments/run/statistics.hpp"

namespace wheelhop {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// What the rows of one cell hold.
struct CellRows {
  Index n = 0, n_ok = 0;
  std::map<std::string, Index> failures;
  std::vector<std::string> columns;  // in the order of their first row
  std::map<std::string, std::vector<double>> values;

  void add(const Grid& grid, const Json& row) {
    ++n;
    const bool ok = row["status"] == "ok";
    n_ok += ok;
    if (!ok) ++failures[row["message"].get<std::string>()];
    for (const auto& [column, value] : row.items()) {
      if (!value.is_number() || column == "cell" || column == "realisation" || column == "seed" ||
          grid.axis_called(column) >= 0)
        continue;
      std::vector<double>& own = values[column];
      if (own.empty()) columns.push_back(column);
      own.push_back(value.get<double>());
    }
  }
};

Json statistics_of_column(const std::string& column, std::vector<double> values, Index rows) {
  const auto n_ok = static_cast<Index>(values.size());
  const Better way = better(column);
  if (way != Better::neither) values.resize(static_cast<std::size_t>(rows), worst(way));
  std::sort(values.begin(), values.end());
  return {{"median", quantile(values, 0.5)},
          {"q05", quantile(values, 0.05)},
          {"q95", quantile(values, 0.95)},
          {"min", values.front()},
          {"max", values.back()},
          {"worst", way == Better::smaller  ? Json(values.back())
                    : way == Better::larger ? Json(values.front())
                                            : Json()},
          {"n_ok", n_ok},
          {"n", rows}};
}

/// Of how many starts a solver ends within 1 % of the least cost that any of them reached on the same data.
class NearBest {
 public:
  explicit NearBest(const Grid& grid) {
    for (std::size_t c = 0; c < grid.cells.size(); ++c) {
      Json data = grid.cells[c].beside_base;
      data.erase("solver");
      data_.push_back(data.dump());
    }
  }
  void add(const RowKey& key, const Json& row) {
    for (std::size_t i = 0; i < kColumns.size(); ++i) {
      if (!row.contains(kColumns[i]) || !row[kColumns[i]].is_number()) continue;
      const double cost = row[kColumns[i]].get<double>();
      costs_[i].emplace_back(key, cost);
      double& best = least_[i].try_emplace({data_[key.cell], key.realisation}, cost).first->second;
      best = std::min(best, cost);
    }
  }
  void put(Json& cells) const {
    for (std::size_t i = 0; i < kColumns.size(); ++i) {
      std::vector<Index> near(data_.size(), 0);
      for (const auto& [key, cost] : costs_[i])
        near[key.cell] += cost <= 1.01 * least_[i].at({data_[key.cell], key.realisation});
      for (std::size_t c = 0; c < near.size(); ++c)
        cells[c][std::string(kColumns[i]) + "_within_1_percent_of_best"] = near[c];
    }
  }

 private:
  static constexpr std::array<const char*, 2> kColumns = {"map_cost", "joint_cost"};
  std::vector<std::string> data_;  // what a cell's data are made by
  std::array<std::vector<std::pair<RowKey, double>>, 2> costs_;
  std::array<std::map<std::pair<std::string, Index>, double>, 2> least_;
};

std::string quoted(const std::string& text) {
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string out = "\"";
  for (const char letter : text) out += letter == '"' ? std::string("\"\"") : std::string(1, letter);
  return out + "\"";
}

}  // namespace

Better better(const std::string& column) {
  const auto holds = [&](const char* word) { return column.find(word) != std::string::npos; };
  if (holds("_vaf_") || column.ends_with("_r2")) return Better::larger;
  if (holds("_rmse_") || column.ends_with("_cost")) return Better::smaller;
  return Better::neither;
}

double worst(Better way) {
  return way == Better::larger    ? -kInfinity
         : way == Better::smaller ? kInfinity
                                  : std::numeric_limits<double>::quiet_NaN();
}

Json table_json(const Grid& grid, const RowIndex& rows) {
  Json cells = Json::array();
  NearBest near_best(grid);
  CellRows current;
  std::size_t number = 0;
  const auto finish = [&] {
    Json cell = {{"cell", number}};
    for (std::size_t i = 0; i < grid.axes.size(); ++i) cell[grid.axes[i].name] = grid.value(number, i);
    cell["n_ok"] = current.n_ok;
    cell["n"] = current.n;
    for (const auto& [message, count] : current.failures)
      cell["failures"].push_back({{"message", message}, {"count", count}});
    cell["columns"] = Json::object();
    for (const std::string& column : current.columns)
      cell["columns"][column] = statistics_of_column(column, std::move(current.values[column]), current.n);
    cell["config_beside_base"] = grid.cells[number].beside_base;
    cells.push_back(std::move(cell));
    current = {};
  };
  rows.for_each([&](const RowKey& key, const std::string& line) {
    for (; number < key.cell; ++number) finish();
    const Json row = parse_json(line, "row");
    current.add(grid, row);
    if (grid.measure == Measure::solver) near_best.add(key, row);
  });
  for (; number < grid.cells.size(); ++number) finish();
  if (grid.measure == Measure::solver) near_best.put(cells);
  return {{"schema", "wheelhop.table/2"},
          {"cells", std::move(cells)},
          {"excluded_cells", grid.excluded},
          {"grid", grid.effective}};
}

void write_rows_csv(const RowIndex& rows, const std::filesystem::path& file) {
  std::vector<std::string> columns;
  std::map<std::string, std::size_t> known;
  rows.for_each([&](const RowKey&, const std::string& line) {
    const Json row = parse_json(line, "row");
    for (const auto& [column, value] : row.items())
      if (known.try_emplace(column, columns.size()).second) columns.push_back(column);
  });
  const std::filesystem::path beside = temporary_beside(file);
  {
    std::ofstream stream(beside, std::ios::binary | std::ios::trunc);
    for (std::size_t i = 0; i < columns.size(); ++i) stream << (i == 0 ? "" : ",") << quoted(columns[i]);
    stream << '\n';
    std::vector<std::string> fields(columns.size());
    rows.for_each([&](const RowKey&, const std::string& line) {
      std::fill(fields.begin(), fields.end(), "");
      const Json row = parse_json(line, "row");
      for (const auto& [column, value] : row.items())
        if (!value.is_null())
          fields[known[column]] = value.is_string() ? quoted(value.get<std::string>()) : value.dump();
      for (std::size_t i = 0; i < fields.size(); ++i) stream << (i == 0 ? "" : ",") << fields[i];
      stream << '\n';
    });
    if (!stream.flush()) {
      std::filesystem::remove(beside);
      throw UserError(file.string() + ": cannot be written; the rows are kept, start again to go on");
    }
  }
  std::filesystem::rename(beside, file);
}

bool is_headline(Measure measure, const std::string& column) {
  switch (measure) {
    case Measure::linear: return column.starts_with("linear_vaf_");
    case Measure::inversion: return column == "inversion_r2" || column == "trusted_share";
    case Measure::nonlinear: return column.starts_with("nonlinear_vaf_");
    case Measure::refined: return column.starts_with("refined_vaf_");
    case Measure::solver:
      return column == "map_cost" || column == "map_evaluations" || column == "joint_cost" ||
             column == "joint_evaluations";
  }
  return false;
}

std::vector<std::string> headline(const Grid& grid, const Json& table) {
  std::vector<std::string> columns;
  for (const Json& cell : table.at("cells"))
    for (const auto& [column, statistics] : cell.at("columns").items())
      if (is_headline(grid.measure, column) && std::find(columns.begin(), columns.end(), column) == columns.end())
        columns.push_back(column);
  return columns;
}

void print_table(const Grid& grid, const Json& table) {
  const std::vector<std::string> columns = headline(grid, table);
  fmt::print("median [5 %, 95 %] of the realisations of each cell\n");
  std::vector<std::size_t> width;
  for (std::size_t i = 0; i < grid.axes.size(); ++i) {
    width.push_back(grid.axes[i].name.size());
    for (const std::string& label : grid.axes[i].labels) width.back() = std::max(width.back(), label.size());
    fmt::print("{:<{}}  ", grid.axes[i].name, width[i]);
  }
  for (const std::string& column : columns) fmt::print("{:<34}  ", column);
  fmt::print("ok\n");
  for (std::size_t c = 0; c < grid.cells.size(); ++c) {
    const Json& cell = table.at("cells").at(c);
    for (std::size_t i = 0; i < grid.axes.size(); ++i) fmt::print("{:<{}}  ", grid.label(c, i), width[i]);
    for (const std::string& column : columns) {
      if (!cell["columns"].contains(column)) {
        fmt::print("{:<34}  ", "-");
        continue;
      }
      const Json& s = cell["columns"][column];
      const auto number = [&](const char* key) {
        return s[key].is_number() && std::isfinite(s[key].get<double>()) ? fmt::format("{:.5g}", s[key].get<double>())
                                                                         : "failed";
      };
      fmt::print("{:<34}  ", fmt::format("{} [{}, {}]", number("median"), number("q05"), number("q95")));
    }
    for (const char* key : {"map_cost_within_1_percent_of_best", "joint_cost_within_1_percent_of_best"})
      if (cell.contains(key)) fmt::print("{:>3} ", cell[key].get<Index>());
    fmt::print("{}/{}\n", cell["n_ok"].get<Index>(), cell["n"].get<Index>());
  }
}

}  // namespace wheelhop
