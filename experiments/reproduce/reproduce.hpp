/// \file
/// `wheelhop reproduce`: Table 1 and Figures 4 to 6 of the paper, over several realisations of drive and noise.
#pragma once

#include <filesystem>
#include <optional>

#include "core/base/linalg.hpp"

namespace wheelhop {

struct ReproduceRequest {
  std::filesystem::path config;  ///< empty: the preset experiments/configs/paper.json
  std::filesystem::path out = "out/reproduce";
  std::optional<Index> realisations;  ///< these four stand before the config
  std::optional<Index> seed;
  std::optional<double> snr_db;
  Index jobs = 0;  ///< realisations at once; 0: as many as the machine has threads. Results do not depend on it.
  bool quiet = false;
};

/// Writes `table1.json`, `figures/figures.json` and `timing.json` into `out`, then asks `plots/render.mjs` for the
/// figures and the report page, and prints the table beside the paper's.
/// @return 0; 1 if a simulation, a linear, nonlinear or refined model failed in a realisation (the rows of the file say
/// which). A free run of the model "as printed" that diverges is a finding, not a failure. UserError for mistakes in
/// the config and an `out` that cannot be written, both before anything is computed.
int run_reproduce(const ReproduceRequest& request);

}  // namespace wheelhop
