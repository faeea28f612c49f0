/// \file
/// `wheelhop decide D.json`: the verdict of a diagnosis again, from its stored evidence, without a simulation.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/base/json.hpp"
#include "core/gap/verdict/verdict.hpp"

namespace wheelhop {

struct DecideRequest {
  std::filesystem::path diagnosis;    ///< a diagnosis file, or its `evidence` alone
  std::vector<std::string> settings;  ///< "NAME=VALUE" of thresholds
};

/// A verdict as JSON: the row of the decision table, names, suspects, places; schema `wheelhop.verdict/1`.
Json verdict_json(const Evidence& evidence, const Verdict& verdict);

/// Prints the verdict as JSON on stdout. Thresholds are those of the file, or the program's own where it has none, with
/// the settings over them. @return 0. UserError for every mistake in the file or a setting.
int run_decide(const DecideRequest& request);

}  // namespace wheelhop
