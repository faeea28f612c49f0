// blind make, run, score: the test of the diagnosis.
#include <limits>

#include "core/base/linalg.hpp"
#include "experiments/blind/calibrate.hpp"
#include "experiments/blind/make.hpp"
#include "experiments/blind/run.hpp"
#include "experiments/blind/score.hpp"
#include "experiments/command/command.hpp"

namespace wheelhop {
namespace {

void add_blind_make(CLI::App& app, Run& run) {
  auto [command, request] =
      add_command(app, "make", "cases whose effect is withheld, with a sealed key", run, run_blind_make);
  command.add_option("CONFIG", request.config, "sets of cases as JSON, e.g. experiments/configs/blind_check.json")
      ->required();
  command.add_option("--out", request.out, "new folder for the cases and their manifest")->required();
  command.add_option("--key", request.key, "folder for the key and the truth, outside of --out")->required();
  command.add_option("--seed", request.seed, "instead of the config's: cases that nobody can make again without it")
      ->check(CLI::Range(Index{0}, std::numeric_limits<Index>::max()));
  command.add_option("--jobs", request.jobs, "cases at once (default: all threads); never changes a result")
      ->check(CLI::Range(1, 4096));
  add_quiet(command, request.quiet);
  command.footer(
      "The true systems are simulated by a rig of their own, with effects in forms that differ from the catalogue's.\n"
      "manifest.json holds the SHA-256 of the key: publish it before anyone diagnoses.\n"
      "Example:\n  wheelhop blind make experiments/configs/blind_smoke.json --out out/cases --key out/key");
}

void add_blind_run(CLI::App& app, Run& run) {
  auto [command, request] =
      add_command(app, "run", "diagnose every case of a folder, without its key", run, run_blind_run);
  command.add_option("DIR", request.folder, "folder of cases: CASE/plant.json, CASE/records.json")->required();
  command.add_option("--out", request.out, "folder of the answers; cases that have one are skipped")->required();
  command.add_option("--cases", request.cases,
                     "names or patterns with commas between: case_000,case_01* (default: all)");
  command.add_option("--leave-out", request.leave_out,
                     "key: the family of each case's true effect leaves the catalogue (a test of \"none of these\")");
  command.add_option("--jobs", request.jobs, "cases at once; one case uses all threads too")
      ->check(CLI::Range(1, 4096))
      ->capture_default_str();
  add_quiet(command, request.quiet);
  command.footer(
      "A run that was stopped goes on where it was. A case that cannot be diagnosed gets an answer with `error`; a "
      "disk\n"
      "that is full or too little memory is no answer: it ends the run, and the case is done again.\n"
      "Example:\n  wheelhop blind run out/cases --out out/answers");
}

void add_blind_score(CLI::App& app, Run& run) {
  auto [command, request] =
      add_command(app, "score", "hold answers against the key: rates, targets, every wrong case", run, run_blind_score);
  command.add_option("ANSWERS", request.answers, "folder that `blind run` wrote")->required();
  command.add_option("--key", request.key, "key.json or its folder, with truth/ for the true closure")->required();
  command.add_option("--out", request.out, "scores to write (default: ANSWERS/scores.json)");
  command.add_option("--cases", request.cases, "names or patterns with commas between (default: all of the key)");
  command.add_flag("--names-only", request.names_only,
                   "without the true closure, which simulates every answer: seconds in place of minutes");
  add_quiet(command, request.quiet);
  command.footer(
      "Every case of the key counts; an answer that is an error or absent is wrong.\n"
      "Example:\n  wheelhop blind score out/answers --key out/key");
}

void add_blind_calibrate(CLI::App& app, Run& run) {
  auto [command, request] =
      add_command(app, "calibrate", "how much hangs on each threshold, and what evidence would make of them", run,
                  run_blind_calibrate);
  command.add_option("ANSWERS", request.answers, "folder that `blind run` wrote")->required();
  command.add_option("--key", request.key, "key.json or its folder")->required();
  command.add_option("--out", request.out, "result to write (default: ANSWERS/calibration.json)");
  command.footer(
      "Decides the stored evidence again and again, without a simulation: each threshold at 0.7 and 1.4 times its\n"
      "value, then those that are learnt at the values that fit best. Never on the cases of a blind test itself.\n"
      "Example:\n  wheelhop blind calibrate out/answers --key out/key");
}

}  // namespace

void add_blind(CLI::App& app, Run& run) {
  CLI::App& group = *app.add_subcommand("blind", "a test with withheld effects: how good is the diagnosis?");
  group.require_subcommand(1);
  group.footer("First make, then run, then score; wheelhop blind make --help tells more, with an example.");
  add_blind_make(group, run);
  add_blind_run(group, run);
  add_blind_score(group, run);
  add_blind_calibrate(group, run);
}

}  // namespace wheelhop
