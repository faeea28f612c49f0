/// \file
/// `wheelhop blind calibrate ANSWERS --key KEY`: the thresholds of the verdict held against stored evidence whose truth
/// is known, without a simulation.
#pragma once

#include <filesystem>

namespace wheelhop {

struct BlindCalibrateRequest {
  std::filesystem::path answers;  ///< folder that `blind run` wrote
  std::filesystem::path key;      ///< key.json or its folder
  std::filesystem::path out{};    ///< empty: calibration.json among the answers
};

/// Decides every stored evidence again, with each threshold at 0.7 and 1.4 times its value, and tells how many verdicts
/// change and what that costs. Then fits those thresholds that are learnt (see `kLearnt`), by coordinate search over
/// factors, to the mean loss: (P - right)^2 of the first name (Brier 1950), and 1 for a wrong answer without a name.
/// What the fit is worth is told on cases it has not seen, by five folds.
/// Writes schema `wheelhop.calibration/1`: `sensitivity`, `learnt`, `loss` (as it is; fitted; fitted, held out).
/// @return 0. UserError for mistakes in the key or the answers, and answers without evidence.
int run_blind_calibrate(const BlindCalibrateRequest& request);

}  // namespace wheelhop
