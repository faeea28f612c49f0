/// \file
/// Named columns of numbers: what a measurement file holds, whatever its format.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/base/linalg.hpp"

namespace wheelhop {

/// Named channels on common rows. All values are finite.
struct Table {
  std::vector<std::string> names;  ///< c distinct names
  Matrix columns;                  ///< c x N, one row a channel, one column a sample

  /// Row of the channel called `name`; -1 if there is none.
  Index find(const std::string& name) const;
};

/// Reads `.csv`, `.csv.gz` or `.mat` by the ending of the name (case does not matter).
/// @param wanted variables to read from a `.mat` file, which often holds others too; empty = all. Ignored for CSV.
/// UserError as in csv.hpp and mat.hpp, or for an unknown ending.
Table read_table(const std::filesystem::path& file, const std::vector<std::string>& wanted = {});

/// UserError if no table could be written to a file of this name, by its ending.
void require_table_name(const std::filesystem::path& file);

/// Writes by the ending of the name, all or nothing. UserError if a value is not finite or the file cannot be written.
void write_table(const std::filesystem::path& file, const Table& table);

}  // namespace wheelhop
