/// \file
/// `wheelhop blind run DIR --out ANSWERS`: the diagnosis of every case of a folder, without their key.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace wheelhop {

struct BlindRunRequest {
  std::filesystem::path folder;       ///< holds CASE/plant.json and CASE/records.json
  std::filesystem::path out;          ///< folder of the answers
  std::filesystem::path leave_out{};  ///< key; the family of each case's true effect leaves the catalogue
  std::string cases{};                ///< names or patterns (* ?) with commas between; empty: all
  int jobs = 1;                       ///< cases at once; each spreads over the threads on its own
  bool quiet = false;
};

/// Writes for each case CASE.json (schema `wheelhop.diagnosis/1` with `left_out`, the effects that were taken out),
/// CASE.plant.json (the plant with the answer) and CASE.retuned.json (re-tuned, without an effect), seconds a case into
/// timing.json, and a copy of the folder's manifest.json. A case that cannot be diagnosed gets an answer with `error`.
/// Cases that have an answer are skipped, so that a run that was stopped goes on. The key is read for `leave_out` only.
/// A fault of the machine (disk, memory) stops the run: MachineError; the case has no answer then and is done again.
/// @return 0; 1 if an answer is an error. UserError before anything is computed: no case, a name or pattern that fits
/// none, a case that the key lacks, answers that were made with other effects left out.
int run_blind_run(const BlindRunRequest& request);

/// The names of `all` that a list of names and patterns asks for, in the order of `all`; every one for an empty list.
/// UserError for an entry that fits none.
std::vector<std::string> chosen_cases(const std::vector<std::string>& all, const std::string& list,
                                      const std::string& source);

}  // namespace wheelhop
