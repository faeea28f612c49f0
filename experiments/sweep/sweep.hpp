/// \file
/// `wheelhop sweep`: a grid of methods and data over realisations.
#pragma once

#include <filesystem>

#include "core/base/linalg.hpp"

namespace wheelhop {

struct SweepRequest {
  std::filesystem::path config;
  std::filesystem::path out;
  Index jobs = 0;  ///< rows at once; 0: as many as the machine has threads. Results do not depend on it.
  bool quiet = false;
};

/// Writes `rows.jsonl` (a row for every cell and realisation, whatever happened), `table.json` (per cell: n_ok of n,
/// median, 5 and 95 % quantile, least and largest of every number) and `timing.json`. Rows are written as they are
/// finished and sorted at the end; started again in the same folder, finished rows are kept, and a folder of another
/// grid or build is refused. Prints the table.
/// @return 0; 1 if a row has another status than ok. UserError for mistakes in the config, before anything is computed.
int run_sweep(const SweepRequest& request);

}  // namespace wheelhop
