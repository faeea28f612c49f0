// reproduce, sweep, report: reference results and their pages.
#include <limits>

#include "experiments/command/command.hpp"
#include "experiments/render.hpp"
#include "experiments/reproduce.hpp"
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
  command.add_option("CONFIG", request.config, "base experiment and axes as JSON")->required();
  command.add_option("--out", request.out, "folder to write; started again there, a sweep goes on")->required();
  command.add_option("--jobs", request.jobs, "rows at once (default: all threads); never changes a result")
      ->check(CLI::Range(1, 4096));
  add_quiet(command, request.quiet);
  command.footer(
      "CONFIG is a config of `wheelhop reproduce` and axes over any of its options:\n"
      "  {\"base\": \"../paper.json\", \"measure\": \"refined\", \"realisations\": 20, \"axes\": [\n"
      "    {\"name\": \"snr_db\", \"values\": [40, 20]},\n"
      "    {\"name\": \"method\", \"values\": [\n"
      "      {\"label\": \"paper\", \"set\": {}},\n"
      "      {\"label\": \"cva, rbf\", \"set\": {\"subspace\": {\"name\": \"cva\"}, \"nonlinearity\": {\"name\": "
      "\"rbf\"}}}]}]}\n"
      "measure: linear, inversion, nonlinear, refined (each holds those before it), or solver.\n"
      "Writes rows.jsonl (pandas.read_json(..., lines=True)), table.json and timing.json.\n"
      "Example:\n  wheelhop sweep experiments/configs/ablation/inversion.json --out out/inversion");
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
