/// \file
/// `wheelhop rigs CONFIG --out DIR`: what the program makes of measured rigs, beside what is known of them.
#pragma once

#include <filesystem>

namespace wheelhop {

struct RigsRequest {
  std::filesystem::path config, out;
  bool quiet = false;
};

/// Config: `{"rigs": [RIG, ...]}`. A rig has a `name`, what is `known` of it (by hand, or published) with its
/// `known_rmse` by channel of the unit of the file (may be left out), and one of `"diagnose": {"plant": FILE,
/// "records": FILE}` and `"identify": {"config": FILE, "records": FILE}`, relative to the config.
///
/// Does each as `wheelhop diagnose` and `identify` do, prints what these print and a table at the end, and writes into
/// DIR: NAME.json, NAME.plant.json of a diagnosis, `rigs.json` (schema `wheelhop.rigs/1`) and, apart because no run
/// gives them again, `timing.json` with the seconds. RMSE are of the validation records, one after the other; of a
/// diagnosis all of them pooled, as delivered, re-tuned (gross faults of instruments corrected), and with the answer.
/// @return 0; 1 if a rig failed, the others stand. UserError of a rig whose files are wrong, before any is done where
/// they are not there.
int run_rigs(const RigsRequest& request);

}  // namespace wheelhop
