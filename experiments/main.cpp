// The program: commands, their options, their exit status. 0 done, 1 finished with a numerical outcome that is not ok,
// 2 wrong use.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <exception>
#include <functional>
#include <limits>
#include <new>

#include "core/base/json.hpp"
#include "core/base/status.hpp"
#include "experiments/blind/make.hpp"
#include "experiments/blind/run.hpp"
#include "experiments/blind/score.hpp"
#include "experiments/diagnose.hpp"
#include "experiments/generate.hpp"
#include "experiments/identify.hpp"
#include "experiments/list.hpp"
#include "experiments/plan.hpp"
#include "experiments/render.hpp"
#include "experiments/reproduce.hpp"
#include "experiments/simulate.hpp"

namespace {

using namespace wheelhop;
using Run = std::function<int()>;

/// Values that the commands' options are bound to; they outlive parsing.
struct Arguments {
  bool json = false, quiet = false;
  std::string config, out, records, system, x0 = "auto", folder, page;
  BlindMakeRequest blind_make;
  ReproduceRequest reproduce;
  std::string reproduce_config, reproduce_out = "out/reproduce";
  BlindRunRequest blind_run;
  BlindScoreRequest blind_score;
};

void add_quiet(CLI::App& command, Arguments& arguments) {
  command.add_flag("--quiet", arguments.quiet, "no progress on stderr");
}

void add_list(CLI::App& app, Arguments& arguments, Run& run) {
  CLI::App& command = *app.add_subcommand("list", "every piece, law and drive: source, options, defaults, units");
  command.add_flag("--json", arguments.json, "as JSON");
  command.footer("Example:\n  wheelhop list --json");
  command.callback([&] { run = [&] { return run_list(arguments.json); }; });
}

void add_generate(CLI::App& app, Arguments& arguments, Run& run) {
  CLI::App& command = *app.add_subcommand("generate", "simulate a data set: records, plant, provenance");
  command.add_option("CONFIG", arguments.config, "plant, drives and records as JSON")->required();
  command.add_option("--out", arguments.out, "folder to write")->required();
  add_quiet(command, arguments);
  command.footer("Example:\n  wheelhop generate experiments/configs/generate_quarter_car.json --out out/quarter_car");
  command.callback([&] { run = [&] { return run_generate(arguments.config, arguments.out, arguments.quiet); }; });
}

void add_identify(CLI::App& app, Arguments& arguments, Run& run) {
  CLI::App& command = *app.add_subcommand("identify", "a nonlinear state-space model of a record, with its scores");
  command.add_option("CONFIG", arguments.config, "channels, pieces and options as JSON")->required();
  command.add_option("--records", arguments.records, "records.json with an estimation record")->required();
  command.add_option("--out", arguments.out, "model file to write")->required();
  add_quiet(command, arguments);
  command.footer(
      "CONFIG names the channels, everything else has a default (see wheelhop list):\n"
      "  {\"inputs\": [{\"name\": \"road\", \"unit\": \"m\"}],\n"
      "   \"outputs\": [{\"name\": \"travel\", \"unit\": \"m\"}, {\"name\": \"body_acc\", \"unit\": \"m/s^2\"}],\n"
      "   \"nonlinearity\": {\"name\": \"mlp\", \"hidden_units\": 5}, \"pipeline\": {\"passes\": 3}}\n"
      "or takes them from a plant: {\"plant\": \"plant.json\"}.\n"
      "Example:\n  wheelhop identify experiments/configs/identify_quarter_car.json --records "
      "out/quarter_car/records.json --out out/model.json");
  command.callback(
      [&] { run = [&] { return run_identify(arguments.config, arguments.records, arguments.out, arguments.quiet); }; });
}

void add_simulate(CLI::App& app, Arguments& arguments, Run& run) {
  CLI::App& command = *app.add_subcommand("simulate", "free run of a model or plant on the inputs of records");
  command.add_option("SYSTEM", arguments.system, "model file or plant file")->required();
  command.add_option("--records", arguments.records, "records.json; only the inputs are needed")->required();
  command.add_option("--out", arguments.out, "table to write: .csv, .csv.gz or .mat")->required();
  command.add_option("--x0", arguments.x0, "initial state of a model; auto: estimate where outputs are there")
      ->check(CLI::IsMember({"auto", "estimate", "zero"}))
      ->capture_default_str();
  add_quiet(command, arguments);
  command.footer(
      "Columns: record (number, only where there are several), t, the inputs, the simulated outputs.\n"
      "Example:\n  wheelhop simulate out/model.json --records out/quarter_car/records.json --out out/simulated.csv");
  command.callback([&] {
    run = [&] {
      return run_simulate({arguments.system, arguments.records, arguments.out, arguments.x0, arguments.quiet});
    };
  });
}

void add_diagnose(CLI::App& app, Arguments& arguments, Run& run) {
  CLI::App& command = *app.add_subcommand("diagnose", "why a plant and its records disagree: which effect, how far");
  command.add_option("--plant", arguments.system, "plant file with tolerances")->required();
  command.add_option("--records", arguments.records, "records.json: estimation (best with repeats) and validation")
      ->required();
  command.add_option("--out", arguments.out, "diagnosis to write; the corrected plant stands beside it")->required();
  command.add_option("--report", arguments.page, "page with pictures to write (needs Node.js)");
  add_quiet(command, arguments);
  command.footer(
      "Re-tunes the plant inside its tolerances, tries every effect of `wheelhop list` at every place where it makes\n"
      "sense, and scores on the validation records. Repeats of one drive (repeat_of) give the noise floor.\n"
      "Probabilities compare the effects that were fitted; they are not calibrated on known cases.\n"
      "Example:\n  wheelhop diagnose --plant out/quarter_car/plant.json --records out/quarter_car/records.json "
      "--out out/diagnosis.json --report out/diagnosis.html");
  command.callback([&] {
    run = [&] {
      return run_diagnose({arguments.system, arguments.records, arguments.out, arguments.page, arguments.quiet});
    };
  });
}

void add_plan(CLI::App& app, Arguments& arguments, Run& run) {
  CLI::App& command = *app.add_subcommand("plan", "before a test: which effects its drive shows, which it confuses");
  command.add_option("--plant", arguments.system, "plant file with tolerances")->required();
  command.add_option("--records", arguments.records, "records.json of the planned drives; only the inputs are needed")
      ->required();
  command.add_option("--out", arguments.out, "plan to write as JSON");
  add_quiet(command, arguments);
  command.footer(
      "Simulates every effect of `wheelhop list` at typical size and takes away what parameters could do inside their\n"
      "tolerances. An effect shows if at least one noise level (RMS) is left of it; two effects whose remains have a\n"
      "|cosine| above 0.85 cannot be told apart. Then the same for a menu: level, band, a slow triangle, ride height,\n"
      "repeats, one more sensor. The noise is noise_std of the records, else 1 % of each simulated output.\n"
      "Example:\n  wheelhop plan --plant experiments/configs/paper_plant.json --records out/rig/records.json");
  command.callback([&] {
    run = [&] { return run_plan({arguments.system, arguments.records, arguments.out, arguments.quiet}); };
  });
}

void add_blind_make(CLI::App& group, Arguments& arguments, Run& run) {
  CLI::App& command = *group.add_subcommand("make", "cases whose effect is withheld, with a sealed key");
  BlindMakeRequest& request = arguments.blind_make;
  command.add_option("CONFIG", request.config, "sets of cases as JSON, e.g. experiments/configs/blind_singles.json")
      ->required();
  command.add_option("--out", request.out, "new folder for the cases and their manifest")->required();
  command.add_option("--key", request.key, "folder for the key and the truth, outside of --out")->required();
  command.add_option("--seed", request.seed, "instead of the config's: cases that nobody can make again without it");
  command.add_option("--jobs", request.jobs, "cases at once (default: all threads); never changes a result")
      ->check(CLI::Range(1, 4096));
  add_quiet(command, arguments);
  command.footer(
      "The true systems are simulated by a rig of their own, with effects in forms that differ from the catalogue's.\n"
      "manifest.json holds the SHA-256 of the key: publish it before anyone diagnoses.\n"
      "Example:\n  wheelhop blind make experiments/configs/blind_smoke.json --out out/blind/cases --key out/blind/key");
  command.callback([&] {
    run = [&] {
      request.quiet = arguments.quiet;
      return run_blind_make(request);
    };
  });
}

void add_report(CLI::App& app, Arguments& arguments, Run& run) {
  CLI::App& command = *app.add_subcommand("report", "draw the figures and the page of a result again");
  command.add_option("RESULT", arguments.folder, "folder of a reproduction, or a diagnosis file")->required();
  command.add_option("--out", arguments.out,
                     "page to write (default: report.html in the folder, the diagnosis file's name with .html)");
  command.footer("Example:\n  wheelhop report out/reproduce\n  wheelhop report out/diagnosis.json");
  command.callback([&] {
    run = [&] {
      const Rendered drawn = render(arguments.folder, arguments.out);
      if (drawn.exit_status != 0) std::fprintf(stderr, "wheelhop: report: %s\n", drawn.message.c_str());
      return drawn.exit_status == 0 ? 0 : drawn.exit_status == 2 ? 2 : 1;
    };
  });
}

void add_reproduce(CLI::App& app, Arguments& arguments, Run& run) {
  CLI::App& command = *app.add_subcommand("reproduce", "the paper's Table 1 and Figures 4 to 6");
  ReproduceRequest& request = arguments.reproduce;
  command.add_option("--out", arguments.reproduce_out, "folder to write")->capture_default_str();
  command.add_option("--realisations", request.realisations, "how many pairs of records (default: of the config, 20)")
      ->check(CLI::Range(1, 1000000));
  command.add_option("--seed", request.seed, "master seed (default: of the config, 1)")
      ->check(CLI::Range(Index{0}, std::numeric_limits<Index>::max()));
  command
      .add_option("--snr", request.snr_db, "white noise this many dB below every output, in training and validation")
      ->check(CLI::Range(-100.0, 300.0));
  command.add_option("--jobs", request.jobs, "realisations at once (default: all threads); never changes a result")
      ->check(CLI::Range(1, 4096));
  command.add_option("--config", arguments.reproduce_config,
                     "another config than experiments/configs/paper.json: plant, drive, lengths, pieces, options");
  add_quiet(command, arguments);
  command.footer(
      "Writes table1.json, figures/, report.html and timing.json into the folder, and prints the table.\n"
      "Example:\n  wheelhop reproduce --realisations 4 --out out/quick");
  command.callback([&] {
    run = [&] {
      request.config = arguments.reproduce_config;
      request.out = arguments.reproduce_out;
      request.quiet = arguments.quiet;
      return run_reproduce(request);
    };
  });
}

void add_blind_run(CLI::App& blind, Arguments& arguments, Run& run) {
  CLI::App& command = *blind.add_subcommand("run", "diagnose every case of a folder, without its key");
  BlindRunRequest& request = arguments.blind_run;
  command.add_option("DIR", request.folder, "folder of cases: CASE/plant.json, CASE/records.json")->required();
  command.add_option("--out", request.out, "folder of the answers; cases that have one are skipped")->required();
  command.add_option("--cases", request.cases,
                     "names or patterns with commas between: case_000,case_01* (default: all)");
  command.add_option("--leave-out", request.leave_out,
                     "key: the family of each case's true effect leaves the catalogue (a test of \"none of these\")");
  command.add_option("--jobs", request.jobs, "cases at once; one case uses all threads too")
      ->check(CLI::Range(1, 4096))
      ->capture_default_str();
  add_quiet(command, arguments);
  command.footer("Example:\n  wheelhop blind run out/cases --out out/answers");
  command.callback([&] {
    run = [&] {
      request.quiet = arguments.quiet;
      return run_blind_run(request);
    };
  });
}

void add_blind_score(CLI::App& blind, Arguments& arguments, Run& run) {
  CLI::App& command = *blind.add_subcommand("score", "hold answers against the key: rates, targets, every wrong case");
  BlindScoreRequest& request = arguments.blind_score;
  command.add_option("ANSWERS", request.answers, "folder that `blind run` wrote")->required();
  command.add_option("--key", request.key, "key.json or its folder, with truth/ for the true closure")->required();
  command.add_option("--out", request.out, "scores to write (default: ANSWERS/scores.json)");
  command.add_option("--cases", request.cases, "names or patterns with commas between (default: all of the key)");
  add_quiet(command, arguments);
  command.footer(
      "Every case of the key counts; an answer that is an error or absent is wrong.\n"
      "Example:\n  wheelhop blind score out/answers --key out/key");
  command.callback([&] {
    run = [&] {
      request.quiet = arguments.quiet;
      return run_blind_score(request);
    };
  });
}

void add_blind(CLI::App& app, Arguments& arguments, Run& run) {
  CLI::App& command = *app.add_subcommand("blind", "a test with withheld effects: how good is the diagnosis?");
  command.require_subcommand(1);
  add_blind_make(command, arguments, run);
  add_blind_run(command, arguments, run);
  add_blind_score(command, arguments, run);
}

/// CLI11 would call an unknown command an extra argument.
void require_known_command(const CLI::App& app, int count, char** words) {
  if (count < 2 || words[1][0] == '-') return;
  std::vector<std::string> known;
  for (const CLI::App* command : app.get_subcommands({})) known.push_back(command->get_name());
  const std::string word = words[1];
  if (std::find(known.begin(), known.end(), word) != known.end()) {
    const CLI::App& command = *app.get_subcommand(word);
    if (!command.get_subcommands({}).empty()) require_known_command(command, count - 1, words + 1);
    return;
  }
  const std::string nearest = nearest_name(word, known);
  throw UserError("unknown command \"" + word + "\"; known commands: " + join_names(known) +
                  (nearest.empty() ? "" : "; did you mean \"" + nearest + "\"?"));
}

int run_program(int count, char** words) {
  CLI::App app("wheelhop: identification of nonlinear vibration dynamics", "wheelhop");
  app.require_subcommand(1);
  app.set_help_all_flag("--help-all", "help of every command");
  app.footer("wheelhop COMMAND --help tells more, with an example.");
  Arguments arguments;
  Run run;
  add_list(app, arguments, run);
  add_generate(app, arguments, run);
  add_identify(app, arguments, run);
  add_simulate(app, arguments, run);
  add_diagnose(app, arguments, run);
  add_blind(app, arguments, run);
  add_plan(app, arguments, run);
  add_reproduce(app, arguments, run);
  add_report(app, arguments, run);
  require_known_command(app, count, words);
  if (count < 2) {
    std::fputs(app.help().c_str(), stderr);
    return 2;
  }
  try {
    app.parse(count, words);
  } catch (const CLI::Success& help) {  // --help
    return app.exit(help);
  } catch (const CLI::ParseError& error) {
    throw UserError(std::string(words[1]) + ": " + error.what() + " (wheelhop " + words[1] + " --help)");
  }
  return run();
}

}  // namespace

int main(int count, char** words) {
  try {
    return run_program(count, words);
  } catch (const wheelhop::UserError& error) {
    std::fprintf(stderr, "wheelhop: %s\n", error.what());
    return 2;
  } catch (const std::bad_alloc&) {
    std::fputs("wheelhop: not enough memory\n", stderr);
    return 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "wheelhop: failed: %s\n", error.what());
    return 1;
  }
}
