/// \file
/// `wheelhop blind score ANSWERS --key KEYDIR`: how good the answers of a blind test are.
#pragma once

#include <filesystem>
#include <string>

namespace wheelhop {

struct BlindScoreRequest {
  std::filesystem::path answers;  ///< folder that `blind run` wrote
  std::filesystem::path key;      ///< key.json or its folder; `truth/CASE/records.json` beside it, where it is there
  std::filesystem::path out{};    ///< empty: scores.json among the answers
  std::string cases{};            ///< names or patterns (* ?) with commas between; empty: every case of the key
  bool names_only = false;        ///< leaves the true closure out, which simulates every answer
  bool quiet = false;
};

/// Prints the scores beside their targets, groups of cases, calibration, confusions and every wrong case, and writes
/// them (schema `wheelhop.blind_scores/1`): `targets`, `groups` (all, clear, and by strength, kind, set, effect, drive,
/// plant), `confusion` (true effect, then named effect) and `cases`, a row each: `fault` is null where it is right,
/// `closure_true` where it was not measured (`names_only`, no truth) or the corrected plant cannot follow the drive. A
/// rate has `hits`, `n` and `wilson95`, any other score its `n`. Every case of the key counts: an answer that is an
/// error or absent is wrong. Same answers and key, same bytes.
/// @return 0; 1 if an answer is an error or absent. UserError for mistakes in the key, a key without any answer, and a
/// manifest among the answers that tells of another number of cases or another SHA-256 of the key.
int run_blind_score(const BlindScoreRequest& request);

}  // namespace wheelhop
