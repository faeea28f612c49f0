// reproduce, sweep, report: reference results and their pages.
#include <fmt/format.h>

#include <limits>

#include "experiments/command/command.hpp"
#include "experiments/compare/compare.hpp"
#include "experiments/report/render.hpp"
#include "experiments/reproduce/reproduce.hpp"
#include "experiments/rigs/rigs.hpp"
#include "experiments/sweep/grid.hpp"
#include "experiments/sweep/sweep.hpp"

namespace wheelhop {

void add_reproduce(CLI::App& app, Run& run) {
  auto [command, request] = add_command(app, "reproduce", "the paper's Table 1 and Figures 4 to 6", run, run_reproduce);
  command.add_option("--out", request.out, "folder to write")->default_str(request.out.string());
  command.add_option("--realisations", request.realisations, "how many pairs of records (default: of the config, 20)")
      ->check(CLI::Range(1, 1000000));
  command.add_option("--seed", request.seed, "master seed (default: of the config, 1)")
      ->check(CLI::Range(Index{0}, std::numeric_limits<Index>::max()));
  command
      .add_option("--snr", request.snr_db, "white noise this many dB below every output, in training and validation")
      ->check(CLI::Range(-100.0, 300.0));
  command.add_option("--jobs", request.jobs, "realisations at once (default: all threads); never changes a result")
      ->check(CLI::Range(1, 4096));
  command.add_option("--config", request.config,
                     "another config than experiments/configs/paper.json: plant, drive, lengths, pieces, options");
  add_quiet(command, request.quiet);
  command.footer(
      "Writes table1.json, figures/, report.html and timing.json into the folder, and prints the table.\n"
      "Example:\n  wheelhop reproduce --realisations 4 --out out/quick");
}

void add_sweep(CLI::App& app, Run& run) {
  auto [command, request] =
      add_command(app, "sweep", "a grid of methods and data over realisations, as result tables", run, run_sweep);
  command.add_option("CONFIG", request.config, "base experiment and axes as JSON");
  command.add_option("--out", request.out, "folder to write; started again there, a sweep goes on");
  command.add_option("--jobs", request.jobs, "rows at once (default: all threads); never changes a result")
      ->check(CLI::Range(1, 4096));
  command.add_option("--shard", request.shard,
                     "I/N: compute every N-th row only; the call that finds all rows in the folder writes the table");
  command.add_flag("--dry-run", request.dry_run, "print the grid and an estimate of the time, and write nothing");
  command.add_option("--recompute", request.recompute,
                     "make the row with this config_hash in --out again, and say whether its bytes are the same");
  add_quiet(command, request.quiet);
  std::string known;
  for (const auto& [name, meaning] : presets()) known += fmt::format("    {:<14} {}\n", name, meaning);
  command.footer(
      "CONFIG is an experiment (a config of `wheelhop reproduce`) and axes over any of its options:\n"
      "  {\"base\": \"../paper.json\", \"measure\": \"refined\", \"realisations\": 20, \"axes\": [\n"
      "    {\"name\": \"snr_db\", \"from\": 60, \"to\": 20, \"step\": -20},\n"
      "    {\"name\": \"method\", \"values\": [\n"
      "      {\"label\": \"paper\", \"set\": {}},\n"
      "      {\"label\": \"cva, rbf\", \"set\": {\"subspace\": {\"name\": \"cva\"}, \"nonlinearity\": {\"name\": "
      "\"rbf\"}}}]}],\n"
      "   \"exclude\": [{\"snr_db\": 60, \"method\": \"paper\"}]}\n"
      "The name of an axis is the path of an option (\"pipeline.passes\", \"drive.rms\",\n"
      "\"plant_parameters.suspension.viscous_damper.damping_ns_per_m\"), or free where every value has a `set`.\n"
      "{\"zip\": [AXIS, AXIS]} varies axes together; {\"preset\": NAME} is a whole axis:\n" +
      known +
      "measure: linear, inversion, nonlinear, refined (each holds those before it), or solver.\n"
      "Writes rows.jsonl (pandas.read_json(..., lines=True)), rows.csv (MATLAB's readtable), table.json, timing.json.\n"
      "On several machines: mpirun -n 8 wheelhop sweep ..., or --shard 1/8 to 8/8 as a job array.\n"
      "Example:\n  wheelhop sweep experiments/configs/ablation/inversion.json --out out/inversion");
}

void add_compare(CLI::App& app, Run& run) {
  auto [command, request] = add_command(
      app, "compare", "paired statistics of a sweep: intervals, corrected tests, ranks, profiles", run, run_compare);
  command.add_option("DIR", request.folder, "folder of a sweep, finished or not")->required();
  command.add_option("--over", request.options.over, "axis whose values are compared")->required();
  command.add_option("--by", request.options.by, "axes that are looked at value by value; the others are pooled")
      ->delimiter(',');
  command.add_option("--metric", request.options.metrics, "columns of the rows (default: those the sweep is read by)")
      ->delimiter(',');
  command
      .add_option("--equivalence", request.options.equivalence,
                  "differences up to this are ties (default: 0.1 for a VAF in percent, else 0)")
      ->check(CLI::Range(0.0, 1e300));
  command.add_option("--out", request.out, "file to write (default: compare.json in DIR)");
  command.footer(
      "Pairs are rows of the same realisation whose cells differ on the axis --over alone. A row that failed counts "
      "as\n"
      "worse than any value. Per pair of methods: the median difference with a 95 % bootstrap interval, wins, ties "
      "and\n"
      "losses, Wilcoxon's signed-rank test corrected by Holm over all pairs, the rank-biserial correlation; per group\n"
      "Friedman's ranks with Nemenyi's critical difference, and Dolan and More's performance profiles.\n"
      "Example:\n  wheelhop compare out/inversion --over inversion --by snr_db");
}

void add_rigs(CLI::App& app, Run& run) {
  auto [command, request] =
      add_command(app, "rigs", "diagnose and identify measured rigs, beside what is known of them", run, run_rigs);
  command.add_option("CONFIG", request.config, "list of rigs: name, what is known, plant or config, records")
      ->required();
  command.add_option("--out", request.out, "folder to write: a result a rig, rigs.json, timing.json")->required();
  add_quiet(command, request.quiet);
  command.footer(
      "{\"rigs\": [{\"name\": \"damper\", \"known\": \"friction, by hand\", \"known_rmse\": {\"force\": 12.5},\n"
      "           \"diagnose\": {\"plant\": \"damper.json\", \"records\": \"damper_records.json\"}}]}\n"
      "or \"identify\": {\"config\": FILE, \"records\": FILE} in place of \"diagnose\". A rig that fails stands there "
      "with its\nmessage, and the others are done. The records of the example are public "
      "and not in this\nproject: results/README.md says where each comes from.\n"
      "Example:\n  wheelhop rigs experiments/configs/rigs/rigs.json --out out/rigs");
}

void add_report(CLI::App& app, Run& run) {
  auto [command, request] =
      add_command(app, "report", "draw the figures and the page of a result again", run, run_report);
  command.add_option("RESULT", request.result, "folder of a reproduction, or a diagnosis file")->required();
  command.add_option("--out", request.page,
                     "page to write (default: report.html in the folder, the diagnosis file's name with .html)");
  command.footer("Example:\n  wheelhop report out/reproduce\n  wheelhop report out/rig.json");
}

}  // namespace wheelhop
