/// \file
/// `wheelhop blind make CONFIG --out DIR --key KEYDIR`: cases for a blind check of the diagnosis. A true system (a
/// plant with parameters off inside their tolerances and with effects that the plant file does not hold) is simulated
/// by the generator's own rig; only records and the plant as delivered are handed out, and the key is kept apart under
/// a published check sum.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

namespace wheelhop {

struct BlindMakeRequest {
  std::filesystem::path config, out, key;
  std::optional<std::uint64_t> seed =
      {};        ///< instead of the config's: cases that nobody who knows the config can remake
  int jobs = 0;  ///< cases at once; 0: all threads. Never changes a result
  bool quiet = false;
};

/// Config: see experiments/rig/cases.hpp.
/// Writes DIR/case_NNN/{plant.json, records.json, est_1.csv.gz, est_2.csv.gz, val.csv.gz} in an order that tells
/// nothing, DIR/manifest.json (number of cases, SHA-256 of the key), KEYDIR/key.json and, unless the config says
/// `"truth": false`, KEYDIR/truth/case_NNN/{records.json, val_long.csv.gz, beyond.csv.gz}, free of noise.
///
/// Key: an array, an entry a case: case, set, class, plant, drive, coloured, noise (relative RMS), strength_class
/// (weak, medium, strong: re-tuning inside the tolerances leaves 0.3 to 0.7, to 2, to 6 times the noise, in class
/// double of each effect alone; in class parameter thirds of 4 to 8 tolerances; "none" in class none), gap_sigma (what
/// re-tuning leaves, RMS over the noise's, pooled over channels; 0 in class parameter, whose errors a re-tuning beyond
/// the tolerance takes up), gap_delivered_sigma (the same without re-tuning), effects [{effect, location, in_catalogue,
/// form, strength, unit}]. Cases whose effect cannot reach its gap are left out: their entries stand at the end with
/// `"case": null`, `"strength_class": "unreachable"` and `why`, and stderr names them.
///
/// @return 0. UserError for every mistake in the config, a DIR that is not empty, a KEYDIR inside DIR or with a key,
/// but for the key of the same cases, which a call that was stopped had put in place before them.
int run_blind_make(const BlindMakeRequest& request);

}  // namespace wheelhop
