// reproduce, report: reference results and their pages.
#include <limits>

#include "experiments/command/command.hpp"
#include "experiments/render.hpp"
#include "experiments/reproduce.hpp"

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

void add_report(CLI::App& app, Run& run) {
  auto [command, request] =
      add_command(app, "report", "draw the figures and the page of a result again", run, run_report);
  command.add_option("RESULT", request.result, "folder of a reproduction, or a diagnosis file")->required();
  command.add_option("--out", request.page,
                     "page to write (default: report.html in the folder, the diagnosis file's name with .html)");
  command.footer("Example:\n  wheelhop report out/reproduce\n  wheelhop report out/rig.json");
}

}  // namespace wheelhop
