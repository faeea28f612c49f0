#include "experiments/sweep/sweep.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <fstream>
#include <map>
#include <mutex>
#include <sstream>
#include <thread>

#include "core/base/files.hpp"
#include "experiments/progress.hpp"
#include "experiments/provenance.hpp"
#include "experiments/sweep/cell.hpp"

namespace wheelhop {
namespace {

namespace fs = std::filesystem;
using Key = std::pair<std::size_t, Index>;  // cell, realisation

/// Finished rows of an earlier start. A torn last line, and rows of another config, count as not there.
std::map<Key, std::string> finished_rows(const fs::path& file, const Grid& grid) {
  std::map<Key, std::string> rows;
  if (!fs::exists(file)) return rows;
  std::istringstream lines(read_file(file));
  for (std::string line; std::getline(lines, line);) {
    const Json row = Json::parse(line, nullptr, false);
    if (!row.is_object() || !row.contains("cell") || !row.contains("realisation")) continue;
    const Key key{row["cell"].get<std::size_t>(), row["realisation"].get<Index>()};
    if (key.first < grid.cells.size() && key.second < grid.realisations &&
        row.value("config_hash", "") == grid.cells[key.first].hash)
      rows[key] = line;
  }
  return rows;
}

/// A folder holds rows of one grid and one build.
void claim_folder(const fs::path& out, const Grid& grid) {
  require_writable_folder(out);
  const fs::path file = out / "sweep.json";
  const Json own = {{"schema", "wheelhop.sweep/1"}, {"grid", grid.effective}, {"provenance", provenance()}};
  if (fs::exists(file)) {
    const Json other = parse_json(read_file(file), file.string());
    for (const char* part : {"grid", "provenance"})
      if (!other.contains(part) || other[part] != own[part])
        throw UserError(
            fmt::format("{}: expected the {} of this call, found another: {}\ntake another folder, or remove "
                        "this one to start anew",
                        file.string(), part == std::string("grid") ? "grid" : "build",
                        Json::diff(Json(other.value(part, Json())), Json(own[part])).dump().substr(0, 300)));
  }
  write_json(file, own);
}

/// Appends rows as they come. UserError when the disk is full.
class RowFile {
 public:
  explicit RowFile(const fs::path& file) : file_(file), stream_(file, std::ios::app) {}
  void add(const std::string& row) {
    stream_ << row << '\n' << std::flush;
    if (!stream_) throw UserError(file_.string() + ": cannot be written; what stands there is kept");
  }

 private:
  fs::path file_;
  std::ofstream stream_;
};

/// Every number of the rows of a cell, by column.
Json statistics_of_cell(const std::vector<Json>& rows) {
  std::vector<std::string> columns;
  std::map<std::string, std::vector<double>> values;
  for (const Json& row : rows)
    for (const auto& [column, value] : row.items()) {
      if (!value.is_number() || column == "cell" || column == "realisation") continue;
      if (values[column].empty()) columns.push_back(column);
      values[column].push_back(value.get<double>());
    }
  Json out = Json::object();
  for (const std::string& column : columns) {
    const double largest = *std::max_element(values[column].begin(), values[column].end());
    values[column].resize(rows.size(), -std::numeric_limits<double>::infinity());  // failed rows have none
    const Statistics s = statistics_of(values[column]);
    out[column] = {{"median", s.median}, {"q05", s.q05},   {"q95", s.q95}, {"min", s.min},
                   {"max", largest},     {"n_ok", s.n_ok}, {"n", s.n}};
  }
  return out;
}

/// Of how many starts a solver ends within 1 % of the least cost that any of them reached on the same data.
void count_near_best(const Grid& grid, const std::vector<std::vector<Json>>& by_cell, Json& table) {
  const auto problem_of = [&](std::size_t c, const Json& row) {
    Json config = grid.cells[c].config.effective;
    config.erase("solver");
    config.erase("as_printed");  // which repeats the solver
    return config.dump() + row["realisation"].dump();
  };
  for (const char* column : {"map_cost", "joint_cost"}) {
    std::map<std::string, double> least;
    const auto each = [&](const auto& visit) {
      for (std::size_t c = 0; c < by_cell.size(); ++c)
        for (const Json& row : by_cell[c])
          if (row.contains(column) && row[column].is_number()) visit(c, problem_of(c, row), row[column].get<double>());
    };
    each([&](std::size_t, const std::string& problem, double cost) {
      double& best = least.try_emplace(problem, cost).first->second;
      best = std::min(best, cost);
    });
    std::vector<Index> near(by_cell.size(), 0);
    each([&](std::size_t c, const std::string& problem, double cost) { near[c] += cost <= 1.01 * least[problem]; });
    for (std::size_t c = 0; c < by_cell.size(); ++c)
      table["cells"][c][std::string(column) + "_within_1_percent_of_best"] = near[c];
  }
}

Json table_json(const Grid& grid, const std::map<Key, std::string>& rows) {
  std::vector<std::vector<Json>> by_cell(grid.cells.size());
  for (const auto& [key, line] : rows) by_cell[key.first].push_back(parse_json(line, "row"));
  Json table = {{"schema", "wheelhop.table/1"}, {"cells", Json::array()}};
  for (std::size_t c = 0; c < grid.cells.size(); ++c) {
    Json cell = {{"cell", c}};
    for (std::size_t i = 0; i < grid.axes.size(); ++i) cell[grid.axes[i].name] = grid.cells[c].labels[i];
    Index ok = 0;
    std::map<std::string, Index> failures;
    for (const Json& row : by_cell[c]) {
      const bool good = row["status"] == "ok";
      ok += good;
      if (!good) ++failures[row["message"].get<std::string>()];
    }
    cell["n_ok"] = ok;
    cell["n"] = by_cell[c].size();
    for (const auto& [message, count] : failures) cell["failures"].push_back({{"message", message}, {"count", count}});
    cell["columns"] = statistics_of_cell(by_cell[c]);
    table["cells"].push_back(std::move(cell));
  }
  if (grid.measure == Measure::solver) count_near_best(grid, by_cell, table);
  table["grid"] = grid.effective;
  for (std::size_t c = 0; c < grid.cells.size(); ++c) {
    Json config = grid.cells[c].config.effective;
    Json changed = Json::object();
    for (const auto& [key, value] : config.items())
      if (grid.base.effective[key] != value) changed[key] = value;
    table["cells"][c]["config_beside_base"] = std::move(changed);
  }
  table["provenance"] = provenance();
  return table;
}

/// What a measure is read by, in the order of printing.
std::vector<std::string> headline(Measure measure) {
  const auto vaf = [](const std::string& model) {
    std::vector<std::string> names;
    for (const PaperSignal& signal : kPaperSignals) names.push_back(model + "_vaf_" + signal.name);
    return names;
  };
  switch (measure) {
    case Measure::linear: return vaf("linear");
    case Measure::inversion: return {"inversion_r2", "trusted_share"};
    case Measure::nonlinear: return vaf("nonlinear");
    case Measure::refined: return vaf("refined");
    case Measure::solver: return {"map_cost", "map_evaluations", "joint_cost", "joint_evaluations"};
  }
  return {};
}

void print_table(const Grid& grid, const Json& table) {
  const std::vector<std::string> columns = headline(grid.measure);
  fmt::print("median [5 %, 95 %] of {} realisations: {}\n", grid.realisations, join_names(columns));
  for (const Json& cell : table["cells"]) {
    std::string line;
    for (const Axis& axis : grid.axes) line += fmt::format("{:<24} ", cell[axis.name].get<std::string>());
    for (const std::string& column : columns) {
      if (!cell["columns"].contains(column)) {
        line += fmt::format("{:>26}", "-");
        continue;
      }
      const Json& s = cell["columns"][column];
      const auto number = [&](const char* key) {
        return s[key].is_number() ? fmt::format("{:.5g}", s[key].get<double>()) : "-";
      };
      line += fmt::format("{:>10} {:<16}", number("median"), fmt::format("[{}, {}]", number("q05"), number("q95")));
    }
    for (const char* key : {"map_cost_within_1_percent_of_best", "joint_cost_within_1_percent_of_best"})
      if (cell.contains(key)) line += fmt::format(" {:>3}", cell[key].get<Index>());
    fmt::print("{}({}/{} ok)\n", line, cell["n_ok"].get<Index>(), cell["n"].get<Index>());
  }
}

}  // namespace

int run_sweep(const SweepRequest& request) {
  const Grid grid = read_grid(request.config);
  claim_folder(request.out, grid);
  const fs::path rows_file = request.out / "rows.jsonl";
  std::map<Key, std::string> rows = finished_rows(rows_file, grid);
  std::vector<Key> open;
  for (std::size_t c = 0; c < grid.cells.size(); ++c)
    for (Index r = 0; r < grid.realisations; ++r)
      if (!rows.contains({c, r})) open.emplace_back(c, r);
  std::string kept;  // without a torn line
  for (const auto& [key, line] : rows) kept += line + "\n";
  write_file(rows_file, kept);

  Json timing = {{"schema", "wheelhop.timing/1"}, {"row_s", Json::object()}};
  const fs::path timing_file = request.out / "timing.json";
  if (fs::exists(timing_file) && !rows.empty()) timing = parse_json(read_file(timing_file), timing_file.string());
  RowFile file(rows_file);
  Progress progress("sweep", static_cast<long>(open.size()), request.quiet);
  std::mutex mutex;
  std::atomic<std::size_t> next = 0;
  std::exception_ptr failure;
  const auto work = [&] {
    try {
      for (std::size_t i = next++; i < open.size(); i = next++) {
        const auto start = std::chrono::steady_clock::now();
        const std::string row = compute_row(grid, open[i].first, open[i].second).dump();
        const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        const std::lock_guard lock(mutex);
        file.add(row);
        rows[open[i]] = row;
        timing["row_s"][fmt::format("{}/{}", open[i].first, open[i].second)] = seconds;
        progress.advance();
      }
    } catch (...) {
      next = open.size();
      const std::lock_guard lock(mutex);
      failure = std::current_exception();
    }
  };
  {
    const unsigned threads = std::max(1U, std::thread::hardware_concurrency());
    const Index jobs = request.jobs > 0 ? request.jobs : static_cast<Index>(threads);
    std::vector<std::jthread> others;
    for (Index i = 1; i < jobs; ++i) others.emplace_back(work);
    work();
  }
  write_json(timing_file, timing);
  if (failure) std::rethrow_exception(failure);
  std::string sorted;
  for (const auto& [key, line] : rows) sorted += line + "\n";
  write_file(rows_file, sorted);
  const Json table = table_json(grid, rows);
  write_json(request.out / "table.json", table);
  print_table(grid, table);
  fmt::print("\nwritten: {0}/rows.jsonl, {0}/table.json, {0}/timing.json\n", request.out.string());
  for (const Json& cell : table["cells"])
    if (cell["n_ok"] != cell["n"]) return 1;
  return 0;
}

}  // namespace wheelhop
