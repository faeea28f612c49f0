/// \file
/// `wheelhop simulate MODEL_OR_PLANT.json --records R.json --out S.csv`: free runs.
#pragma once

#include <filesystem>
#include <string>

namespace wheelhop {

struct SimulateRequest {
  std::filesystem::path system;   ///< a model file (wheelhop.model/1) or a plant file
  std::filesystem::path records;  ///< only the inputs are needed
  std::filesystem::path out;      ///< .csv, .csv.gz or .mat
  std::string x0 = "auto";        ///< of a model: "estimate" from the record's first outputs, "zero", or "auto":
                                  ///< estimate where the records hold the outputs. A plant starts in equilibrium.
  bool quiet = false;
};

/// Columns of the table: `record` (number in records.json, only where there are several), `t` in seconds from the start
/// of the record, the inputs, the simulated outputs under their own names.
/// Runs that leave a model's training range are named on stderr.
/// @return 0; 1 if a run diverged or left the domain of a law: then nothing is written and stderr says where.
int run_simulate(const SimulateRequest& request);

}  // namespace wheelhop
