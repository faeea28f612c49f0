/// \file
/// `wheelhop sweep`: a grid of methods and data over realisations.
#pragma once

#include <filesystem>
#include <string>

#include "experiments/run/rows.hpp"

namespace wheelhop {

struct SweepRequest {
  std::filesystem::path config;
  std::filesystem::path out;
  Index jobs = 0;         ///< rows at once; 0: as many as the machine has threads. Results do not depend on it.
  std::string shard;      ///< "I/N": this process computes every N-th row; empty: all
  std::string recompute;  ///< hash of a row to make again; empty: none
  bool dry_run = false;
  bool quiet = false;
};

/// Writes `sweep.json` (the grid, and the build), `rows.jsonl` (a row for every cell and realisation, whatever
/// happened), the same as `rows.csv`, `table.json` (per cell: n_ok of n, median, quantiles, worst of every number) and
/// `timing.json`. Rows are written as they are finished; the other files once all are there, whichever process finishes
/// last. Started again in the same folder, finished rows are kept; a folder of another grid or build is refused with
/// the difference. Prints the table. Started by mpirun or srun, rows are spread over the ranks.
/// `dry_run` prints the grid and an estimate of the time and writes nothing; `recompute` makes one row of a folder
/// again and says whether its bytes are the same.
/// @return 0; 1 if a row has another status than ok, or a row made again differs. UserError for mistakes in the config,
/// before anything is computed, and for a folder that cannot be written.
int run_sweep(const SweepRequest& request);

}  // namespace wheelhop
