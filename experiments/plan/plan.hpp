/// \file
/// `wheelhop plan --plant P.json --records R.json [--out X.json]`: before a test, what its drives could show.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/gap/plan/plan.hpp"

namespace wheelhop {

struct PlanRequest {
  std::filesystem::path plant, records;
  std::filesystem::path out;  ///< empty: nothing is written
  bool quiet = false;
};

/// Prints the answer in one sentence and tables, and writes `out` (schema `wheelhop.plan/1`). Records need no outputs:
/// those with the role "estimation" count, or all if none has it; repeats of a drive count as repeats.
/// @return 0; 1 if the plant cannot follow the drives: then nothing is written. UserError for every mistake in the
/// files, before anything is computed.
int run_plan(const PlanRequest& request);

/// The sentence that comes first.
std::string plan_answer(const Plan& plan);
void print_plan(const Plan& plan, const std::vector<std::string>& assumed_noise);
/// "coulomb_friction at suspension".
std::string effect_name(const PlannedEffect& effect);

}  // namespace wheelhop
