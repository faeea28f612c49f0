#include "experiments/sweep/sweep.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <set>

#include "core/base/files.hpp"
#include "core/base/status.hpp"
#include "experiments/compare/compare.hpp"
#include "experiments/run/file_uses.hpp"
#include "experiments/run/provenance.hpp"
#include "experiments/run/standard_output.hpp"
#include "experiments/run/statistics.hpp"
#include "experiments/sweep/cell.hpp"
#include "experiments/sweep/folder.hpp"
#include "experiments/sweep/table.hpp"

namespace wheelhop {
namespace {

namespace fs = std::filesystem;

Shard read_shard(const std::string& text) {
  if (text.empty()) return {};
  Shard shard;
  const char* const end = text.data() + text.size();
  const auto number = std::from_chars(text.data(), end, shard.number);
  const bool slash = number.ptr != end && *number.ptr == '/';
  const auto of = std::from_chars(slash ? number.ptr + 1 : end, end, shard.of);
  if (!slash || number.ec != std::errc() || of.ec != std::errc() || of.ptr != end || shard.number < 1 ||
      shard.number > shard.of || shard.of > 1000000)
    throw UserError("--shard: expected I/N with 1 <= I <= N, for example 2/3, found \"" + text + "\"");
  return shard;
}

std::string go_on(const fs::path& out) {
  return fmt::format("finished rows are kept in {}; start the same command again to go on", out.string());
}

/// The rows of the first `realisations` that a shard has to compute and that are not there, all cells of one
/// realisation before the next.
std::vector<RowKey> open_rows(const Grid& grid, Index realisations, Shard shard, const RowStore& store) {
  std::vector<RowKey> open;
  Index number = 0;
  for (Index r = 0; r < realisations; ++r)
    for (std::size_t c = 0; c < grid.cells.size(); ++c)
      if (number++ % shard.of == shard.number - 1 && !store.has({c, r})) open.push_back({c, r});
  return open;
}

void write_timing(const fs::path& out, const RowIndex& rows, std::size_t cells) {
  std::vector<std::vector<double>> by_cell(cells);
  double total = 0;
  for (const auto& [key, seconds] : rows.seconds())
    if (key.cell < cells) {
      by_cell[key.cell].push_back(seconds);
      total += seconds;
    }
  const std::vector<fs::path> parts = row_files(out, "timing");
  if (total > 0) {
    Json list = Json::array();
    for (std::vector<double>& seconds : by_cell) {
      std::sort(seconds.begin(), seconds.end());
      list.push_back({{"rows", seconds.size()},
                      {"median_s", seconds.empty() ? Json() : Json(quantile(seconds, 0.5))},
                      {"largest_s", seconds.empty() ? Json() : Json(seconds.back())}});
    }
    write_json(out / "timing.json", {{"schema", "wheelhop.timing/2"}, {"rows_s", total}, {"cells", std::move(list)}});
  }  // else an earlier start wrote it
  for (const fs::path& part : parts) fs::remove(part);
}

int dry_run(const Grid& grid, const SweepRequest& request) {
  const Index realisations = grid.until ? grid.until->at_most : grid.realisations;
  const std::size_t cells = grid.cells.size(), rows = cells * static_cast<std::size_t>(realisations);
  for (const Axis& axis : grid.axes)
    fmt::print("{}: {} values: {}\n", axis.name, axis.labels.size(), join_names(axis.labels));
  fmt::print("{} cells ({} left out by rules) x {}{} realisations = {} rows\n", cells, grid.excluded,
             grid.until ? "at most " : "", realisations, rows);
  std::set<std::size_t> timed;
  for (std::size_t i = 0; i < 5; ++i) timed.insert((cells - 1) * i / 4);
  double seconds = 0;
  for (const std::size_t cell : timed) {
    const auto start = std::chrono::steady_clock::now();
    const Json row = compute_row(grid, cell, 0);
    const double took = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    seconds += took;
    std::string labels;
    for (std::size_t i = 0; i < grid.axes.size(); ++i) labels += (i == 0 ? "" : ", ") + grid.label(cell, i);
    fmt::print("  timed: {}: {:.3g} s, {}\n", labels, took, row["status"].get<std::string>());
  }
  const JobOptions options{request.jobs, "", "", true};
  const double all = seconds / static_cast<double>(timed.size()) * static_cast<double>(rows);
  fmt::print("about {:.3g} s of work, {:.3g} min with {} jobs\n", all,
             all / 60 / static_cast<double>(threads_of(options)), threads_of(options));
  return 0;
}

int recompute(const SweepRequest& request) {
  const SweepFolder folder = read_folder(request.out);
  const Grid& grid = folder.grid;
  std::string before;
  RowKey key;
  {
    const FileLock still = hold_rows(request.out);
    const RowIndex rows(request.out, [&](const Json& row) { return is_row_of(grid, row); });
    rows.for_each([&](const RowKey& one, const std::string& line) {
      if (row_hash(grid, one.cell, one.realisation) == request.recompute) std::tie(key, before) = std::pair(one, line);
    });
  }
  if (before.empty())
    throw UserError(
        fmt::format("{}: no row of its grid has the config_hash {}", request.out.string(), request.recompute));
  const std::string again = compute_row(grid, key.cell, key.realisation).dump();
  const bool same = again == before;
  const bool same_build = folder.provenance == provenance();
  fmt::print("cell {}, realisation {}: {}{}\n", key.cell, key.realisation,
             same ? "the same bytes" : "other bytes than before",
             same_build ? "" : " (the folder was made by another build)");
  if (!same) {
    fmt::print("  {}\n",
               fmt::join(list_differences(parse_json(before, "row"), parse_json(again, "row"), "row"), "\n  "));
  }
  return same ? 0 : 1;
}

std::function<std::string(const RowKey&)> row_maker(const Grid& grid) {
  return [&grid](const RowKey& key) { return compute_row(grid, key.cell, key.realisation).dump(); };
}

/// Rank 0, or the only process.
int lead(const SweepRequest& request, const Grid& grid, Shard shard, Ranks& ranks) {
  RowStore store(request.out, shard, [&](const Json& row) { return is_row_of(grid, row); });
  const JobOptions options{request.jobs, "sweep", go_on(request.out), request.quiet};
  Index realisations = grid.realisations;
  Json claims;
  for (bool more = true; more;) {
    compute_rows(store, open_rows(grid, realisations, shard, store), ranks, options, row_maker(grid));
    more = false;
    if (!grid.until) break;
    claims = decided_claims(grid, store, realisations);
    const auto open =
        std::count_if(claims.begin(), claims.end(), [](const Json& one) { return one["claim"].is_null(); });
    if (!request.quiet)
      fmt::print(stderr, "{} realisations: {} of {} claims decided\n", realisations,
                 static_cast<Index>(claims.size()) - open, claims.size());
    more = (open > 0 || claims.empty()) && realisations < grid.until->at_most;
    if (more) realisations = std::min(realisations + grid.until->batch, grid.until->at_most);
  }
  const std::size_t total = grid.cells.size() * static_cast<std::size_t>(realisations);
  Json table;
  const bool whole = store.merge(total, [&] {
    write_rows_csv(store, request.out / "rows.csv");
    write_timing(request.out, store, grid.cells.size());
    table = table_json(grid, store);
    if (grid.until) table["until"] = {{"realisations", realisations}, {"claims", claims}};
    table["comparison"] = usual_comparison(grid, store);
    table["provenance"] = provenance();
    write_json(request.out / "table.json", table);
  });
  if (!whole) {
    fmt::print("{} of {} rows are in {}; the call that finds all of them writes the table\n", store.size(), total,
               request.out.string());
    return 0;
  }
  print_table(grid, table);
  fmt::print("\nwritten: {0}/rows.jsonl, {0}/rows.csv, {0}/table.json, {0}/timing.json\n", request.out.string());
  for (const Json& cell : table["cells"])
    if (cell["n_ok"] != cell["n"]) return 1;
  return 0;
}

/// Every other rank.
int follow(Ranks& ranks, const SweepRequest& request) {
  if (!ranks.agree(true)) return 2;  // rank 0 said why
  try {
    const Grid grid = read_grid(request.config);
    serve_rows(ranks, row_maker(grid));
    return 0;
  } catch (const std::exception& error) {  // rank 0 would wait for ever
    fmt::print(stderr, "wheelhop: rank {}: {}; {}\n", ranks.rank(), error.what(), go_on(request.out));
    ranks.abort(2);
  }
}

int sweep_over(Ranks& ranks, const SweepRequest& request) {
  if (!ranks.first()) return follow(ranks, request);
  bool agreed = false;
  try {
    FileUses()
        .reads_named("CONFIG", request.config)
        .writes_folder("--out", request.out, {"sweep.json", "rows.jsonl", "rows.csv", "table.json", "timing.json"})
        .check();
    const Shard shard = read_shard(request.shard);
    const Grid grid = read_grid(request.config);
    if (ranks.size() > 1 && (shard.of > 1 || request.jobs > 1))
      throw UserError("started by mpirun or srun, rows go to the ranks: leave --shard and --jobs out");
    if (grid.until && shard.of > 1)
      throw UserError("a sweep with `until` needs every row to decide: use --jobs or mpirun in place of --shard");
    claim_folder(request.out, grid);
    agreed = ranks.agree(true);
    const int status = lead(request, grid, shard, ranks);
    end_rows(ranks);
    return status;
  } catch (...) {
    if (agreed)
      end_rows(ranks);
    else
      ranks.agree(false);
    throw;
  }
}

}  // namespace

int run_sweep(const SweepRequest& request) {
  if (!request.recompute.empty() || request.dry_run) require_standard_output();
  if (!request.recompute.empty()) return recompute(request);
  if (request.config.empty()) throw UserError("sweep: expected a CONFIG (wheelhop sweep --help)");
  if (request.dry_run) return dry_run(read_grid(request.config), request);
  if (request.out.empty()) throw UserError("sweep: expected a folder, --out DIR (wheelhop sweep --help)");
  Ranks ranks;
  return sweep_over(ranks, request);
}

}  // namespace wheelhop
