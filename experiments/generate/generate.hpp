/// \file
/// `wheelhop generate CONFIG --out DIR`: a simulated data set with its plant and provenance.
#pragma once

#include <filesystem>

namespace wheelhop {

struct GenerateRequest {
  std::filesystem::path config, out;
  bool quiet = false;
};

/// Reads a config, simulates its records and writes `records.json`, one CSV a record, `plant.json` and
/// `provenance.json` (effective config, seeds, version, level of the noise, lines of a multisine) into `out`.
///
/// Config: `{"plant": FILE or object, "sampling_hz": 200, "hold_hz"?: of the plant, "seed"?: 1, "realisation"?: 0,
/// "noise_snr_db"?: null, "settle_s"?: 2, "start"?: "equilibrium" | "zero", "substeps"?: what the stiffest law
/// needs (1 for a car on its tyres), "records": [{"role": "estimation" | "validation", "duration_s": 60, "drive": DRIVE
/// or {INPUT: DRIVE, ...}, "repeats"?: 1}]}`. Noise enters a measurement before its converter rounds.
/// One DRIVE is used for every input, with other random numbers for each; inputs left out of a list stay at zero.
/// Repeats share the drive and have fresh noise.
///
/// The set appears as a whole or not at all (StagedSet), in place of an earlier one; other files in the folder stay.
/// `records.json` and `provenance.json` bear the same `set`, which is another one for other numbers.
///
/// @return 0; 1 if a simulation left the domain of the plant's laws: then `provenance.json` alone is written and says
/// where, and nothing where the folder holds a set already. UserError for every mistake in the config, before anything
/// is computed. Progress on stderr unless `quiet`.
int run_generate(const GenerateRequest& request);

}  // namespace wheelhop
