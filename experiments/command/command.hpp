/// \file
/// The commands of the program, a file a group: the words each takes, its help, and the function its request goes to.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <memory>
#include <utility>

namespace wheelhop {

/// What the command that was asked for does; returns the exit status.
using Run = std::function<int()>;

/// Each adds one command (blind: with its three) to the program. Parsing it sets `run`, which is kept by reference.
void add_list(CLI::App& app, Run& run);
void add_look(CLI::App& app, Run& run);
void add_generate(CLI::App& app, Run& run);
void add_identify(CLI::App& app, Run& run);
void add_simulate(CLI::App& app, Run& run);
void add_diagnose(CLI::App& app, Run& run);
void add_decide(CLI::App& app, Run& run);
void add_blind(CLI::App& app, Run& run);
void add_plan(CLI::App& app, Run& run);
void add_reproduce(CLI::App& app, Run& run);
void add_rigs(CLI::App& app, Run& run);
void add_report(CLI::App& app, Run& run);
void add_sweep(CLI::App& app, Run& run);
void add_compare(CLI::App& app, Run& run);

/// Adds a command; its options are to be bound to the members of the request that comes back beside it, which `act`
/// gets once they are parsed. The request lives as long as the command.
template <class Request>
std::pair<CLI::App&, Request&> add_command(CLI::App& parent, const char* name, const char* meaning, Run& run,
                                           int (*act)(const Request&)) {
  CLI::App& command = *parent.add_subcommand(name, meaning);
  const auto request = std::make_shared<Request>();
  command.callback([&run, act, request] { run = [act, request] { return act(*request); }; });
  return {command, *request};
}

/// The option of every command that shows its progress.
inline void add_quiet(CLI::App& command, bool& quiet) { command.add_flag("--quiet", quiet, "no progress on stderr"); }

}  // namespace wheelhop
