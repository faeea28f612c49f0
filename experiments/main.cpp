// The program: finds the command asked for, starts it, and answers with its exit status. 0 done, 1 finished with a
// numerical outcome that is not ok, 2 wrong use.
#include <algorithm>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <limits>
#include <new>
#include <string>
#include <system_error>
#include <vector>

#include "core/base/files.hpp"
#include "core/base/json.hpp"
#include "core/base/status.hpp"
#include "experiments/command/command.hpp"
#include "experiments/run/memory.hpp"
#include "experiments/run/provenance.hpp"
#include "experiments/run/standard_output.hpp"
#include "experiments/run/stop.hpp"
#include "variants/extra.hpp"

namespace {

using namespace wheelhop;

constexpr const char* kNoLimits = "--no-limits";

/// Files of any size and packing, and pipes that say nothing for however long.
void lift_limits() {
  constexpr double none = std::numeric_limits<double>::infinity();
  read_limits() = {none, none, none, none};
}

/// CLI11 would call an unknown command an extra argument, or say that there is none.
void require_known_command(const CLI::App& app, int count, char** words) {
  if (count < 2) return;
  const std::string word = words[1];
  if (word == kNoLimits) return require_known_command(app, count - 1, words + 1);
  if (word == "-h" || word == "--help" || word == "--help-all" || word == "--version") return;
  std::vector<std::string> known;
  for (const CLI::App* command : app.get_subcommands({})) known.push_back(command->get_name());
  if (std::find(known.begin(), known.end(), word) != known.end()) {
    const CLI::App& command = *app.get_subcommand(word);
    if (!command.get_subcommands({}).empty()) require_known_command(command, count - 1, words + 1);
    return;
  }
  const std::string nearest = nearest_name(word, known);
  throw UserError("unknown command \"" + word + "\"; known commands: " + join_names(known) +
                  (nearest.empty() ? "" : "; did you mean \"" + nearest + "\"?"));
}

/// "wheelhop blind make", as far as the words were understood.
std::string understood(const CLI::App& app) {
  const std::vector<CLI::App*> parsed = app.get_subcommands();
  return app.get_name() + (parsed.empty() ? "" : " " + understood(*parsed.front()));
}

int run_program(int count, char** words) {
  CLI::App app("wheelhop: vibration dynamics identified from records, and why a simulation and its rig disagree",
               "wheelhop");
  app.require_subcommand(1);
  app.fallthrough();  // what is said to the program may stand behind the command
  app.add_flag_callback(kNoLimits, lift_limits,
                        "read files that unpack to more than their size lets expect, and wait for silent pipes");
  app.set_help_all_flag("--help-all", "help of every command");
  app.set_version_flag("--version", [] {
    const Json facts = provenance();
    return "wheelhop " + facts.at("version").get<std::string>() + ", commit " + facts.at("commit").get<std::string>();
  });
  app.footer(
      "wheelhop COMMAND --help tells more, with an example. A first walk:\n"
      "  wheelhop generate experiments/configs/generate_rig.json --out out/rig\n"
      "  wheelhop diagnose --plant experiments/configs/paper_plant.json --records out/rig/records.json --out "
      "out/rig.json\n"
      "Exit status: 0 done; 1 finished, but a numerical outcome is not ok; 2 wrong use, with one message that says "
      "where.");
  Run run;
  add_list(app, run);
  add_look(app, run);
  add_generate(app, run);
  add_identify(app, run);
  add_simulate(app, run);
  add_diagnose(app, run);
  add_decide(app, run);
  add_blind(app, run);
  add_plan(app, run);
  add_reproduce(app, run);
  add_sweep(app, run);
  add_compare(app, run);
  add_rigs(app, run);
  add_report(app, run);
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
    throw UserError(std::string(error.what()) + " (" + understood(app) + " --help)");
  }
  say_when_stopped("no file is left half written; start the same command again");
  const int status = run();
  finish_standard_output();
  return status;
}

}  // namespace

int main(int count, char** words) {
  try {
    wheelhop::keep_standard_streams();
    wheelhop::keep_freed_memory();
    wheelhop::add_extra_pieces();
    return run_program(count, words);
  } catch (const wheelhop::UserError& error) {
    std::fprintf(stderr, "wheelhop: %s\n", error.what());
    return 2;
  } catch (const std::bad_alloc&) {
    std::fputs("wheelhop: not enough memory\n", stderr);
    return 1;
  } catch (const std::filesystem::filesystem_error& error) {  // of a name that was given
    std::fprintf(stderr, "wheelhop: %s: %s\n", error.path1().c_str(), error.code().message().c_str());
    return 2;
  } catch (const std::system_error& error) {
    const bool printing = std::ferror(stdout) != 0;
    std::fprintf(stderr, "wheelhop: %s: %s\n", printing ? "stdout: cannot write" : "failed",
                 printing ? error.code().message().c_str() : error.what());
    return printing ? 2 : 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "wheelhop: failed: %s\n", error.what());
    return 1;
  }
}
