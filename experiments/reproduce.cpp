#include "experiments/reproduce.hpp"

#include <fmt/format.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <chrono>
#include <cstdio>
#include <thread>

#include "core/base/files.hpp"
#include "experiments/progress.hpp"
#include "experiments/render.hpp"
#include "experiments/reproduce_study.hpp"

namespace wheelhop {
namespace {

std::vector<RealisationRow> compute_all(const ReproduceConfig& config, int jobs, bool quiet) {
  std::vector<RealisationRow> rows(static_cast<std::size_t>(config.realisations));
  Progress progress("reproduce", config.realisations, quiet);
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(jobs));
  tbb::task_arena arena(jobs);
  arena.execute([&] {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, rows.size(), 1), [&](const auto& range) {
      for (std::size_t r = range.begin(); r != range.end(); ++r) {
        rows[r] = compute_realisation(config, static_cast<Index>(r));
        progress.advance();
      }
    });
  });
  return rows;
}

bool all_ok(const std::vector<RealisationRow>& rows) {
  for (const RealisationRow& row : rows) {
    if (row.status != Status::ok) return false;
    for (const Column column : {Column::linear, Column::nonlinear, Column::refined})
      if (row.columns[static_cast<std::size_t>(column)].status != Status::ok) return false;
  }
  return true;
}

/// Figures of an earlier run beside a new table would lie.
void remove_drawings(const std::filesystem::path& out) {
  std::error_code ignored;
  for (const PaperSignal& signal : kPaperSignals)
    std::filesystem::remove(out / "figures" / fmt::format("figure{}.svg", signal.figure), ignored);
  std::filesystem::remove(out / "figures" / "figures.json", ignored);
  std::filesystem::remove(out / "report.html", ignored);
}

void draw(const std::filesystem::path& out) {
  std::fflush(stdout);
  const Rendered drawn = render(out);
  if (drawn.exit_status == 0)
    fmt::print("\nwritten: {0}/table1.json, {0}/figures/figure4.svg to figure6.svg, {0}/report.html\n", out.string());
  else
    fmt::print("\nwritten: {0}/table1.json, {0}/figures/figures.json\nnot drawn: figures and report page ({1})\n",
               out.string(), drawn.message);
}

}  // namespace

int run_reproduce(const ReproduceRequest& request) {
  const ReproduceConfig config = read_reproduce_config(request);
  require_writable_folder(request.out);
  require_writable_folder(request.out / "figures");
  const auto start = std::chrono::steady_clock::now();
  const unsigned threads = std::max(1U, std::thread::hardware_concurrency());
  const int jobs = static_cast<int>(request.jobs > 0 ? request.jobs : threads);
  const std::vector<RealisationRow> rows = compute_all(config, jobs, request.quiet);
  const Json table = table1_json(config, rows), figures = figures_json(config, rows);

  Json timing = {{"schema", "wheelhop.timing/1"}, {"jobs", jobs}};
  timing["total_s"] = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  for (const RealisationRow& row : rows) {
    timing["realisation_s"].push_back(row.seconds);
    timing["as_printed_s"].push_back(row.as_printed_seconds);
  }
  remove_drawings(request.out);
  write_json(request.out / "timing.json", timing);
  if (!figures.is_null()) write_json(request.out / "figures" / "figures.json", figures);
  write_json(request.out / "table1.json", table);
  print_reproduction(config, rows, table);
  if (figures.is_null())
    fmt::print(
        "\nno figures: no realisation has all three models and a second in which the linear one fails and then "
        "does well\n");
  else
    draw(request.out);
  return all_ok(rows) ? 0 : 1;
}

}  // namespace wheelhop
