/// \file
/// `table.json` and `rows.csv` of a sweep, made from its rows one after the other.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "experiments/run/rows.hpp"
#include "experiments/sweep/grid.hpp"

namespace wheelhop {

/// Which way a column of the rows is better. VAF and R^2: larger; RMSE and cost: smaller.
enum class Better { larger, smaller, neither };
Better better(const std::string& column);

/// The worst value there is in this sense, which stands for a row that has none; NaN where neither way is better.
double worst(Better way);

/// Per cell: n_ok of n, failures with their counts, and median, 5 % and 95 % quantile, least and largest value of every
/// number. A row without a value counts as the worst one where a column has a better direction (null in JSON where a
/// quantile falls on it); other columns are summed up over the rows that have one. `n_ok` of a column counts those.
Json table_json(const Grid& grid, const RowIndex& rows);

/// The rows as comma-separated values under one header line, every column that occurs in any row; absent values empty.
void write_rows_csv(const RowIndex& rows, const std::filesystem::path& file);

/// Whether a measure is read by this column.
bool is_headline(Measure measure, const std::string& column);

/// Columns that a measure is read by, of those in the table.
std::vector<std::string> headline(const Grid& grid, const Json& table);

void print_table(const Grid& grid, const Json& table);

}  // namespace wheelhop
