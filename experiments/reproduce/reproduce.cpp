#include "experiments/reproduce/reproduce.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cstdio>

#include "core/base/files.hpp"
#include "experiments/report/render.hpp"
#include "experiments/reproduce/table.hpp"
#include "experiments/run/file_uses.hpp"
#include "experiments/run/jobs.hpp"

namespace wheelhop {
namespace {

std::vector<RealisationRow> compute_all(const ReproduceConfig& config, const JobOptions& options) {
  std::vector<RealisationRow> rows(static_cast<std::size_t>(config.data.realisations));
  run_jobs(rows.size(), options, [&](std::size_t r) -> std::function<void()> {
    rows[r] = compute_realisation(config, static_cast<Index>(r));
    return {};
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

/// Figures of an earlier run beside a new table would lie. Its table goes first: it stands with its own figures only.
void withdraw_earlier(const std::filesystem::path& out) {
  withdraw(out / "table1.json");
  for (const PaperSignal& signal : kPaperSignals)
    withdraw(out / "figures" / fmt::format("figure{}.svg", signal.figure));
  withdraw(out / "figures" / "figures.json");
  withdraw(out / "report.html");
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
  FileUses()
      .reads_named("--config", request.config)
      .writes_folder("--out", request.out, {"table1.json", "timing.json", "report.html", "figures/figures.json"})
      .check();
  const ReproduceConfig config = read_reproduce_config(request);
  require_writable_folder(request.out);
  require_writable_folder(request.out / "figures");
  const auto start = std::chrono::steady_clock::now();
  const JobOptions options{request.jobs, "reproduce", "nothing was written", request.quiet};
  const std::vector<RealisationRow> rows = compute_all(config, options);
  const Json table = table1_json(config, rows), figures = figures_json(config, rows);

  Json timing = {{"schema", "wheelhop.timing/1"}, {"jobs", threads_of(options)}};
  timing["total_s"] = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  for (const RealisationRow& row : rows) {
    timing["realisation_s"].push_back(row.seconds);
    timing["as_printed_s"].push_back(row.as_printed_seconds);
  }
  withdraw_earlier(request.out);
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
