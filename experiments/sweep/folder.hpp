/// \file
/// The folder of a sweep: `sweep.json` says of which grid and build its rows are.
#pragma once

#include <filesystem>

#include "experiments/sweep/grid.hpp"

namespace wheelhop {

struct SweepFolder {
  Grid grid;
  Json provenance;  ///< of the build that computed the rows
};

/// UserError if `sweep.json` is missing or is not what `wheelhop sweep` writes.
SweepFolder read_folder(const std::filesystem::path& folder);

/// Writes `sweep.json` into a folder, made if needed, or finds the same there. UserError if it holds another grid or
/// build, with the differences, or cannot be written.
void claim_folder(const std::filesystem::path& folder, const Grid& grid);

/// Whether a JSON object with whole numbers `cell` and `realisation` is a row of the grid: those numbers exist in it,
/// `config_hash` is theirs, and `status` and `message` are texts.
bool is_row_of(const Grid& grid, const Json& row);

/// Where two values differ: "PATH: BEFORE, now AFTER", at most three of them.
std::vector<std::string> list_differences(const Json& before, const Json& now, const std::string& path);

}  // namespace wheelhop
