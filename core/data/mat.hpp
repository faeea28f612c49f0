/// \file
/// MATLAB files (version 5): one variable a channel.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/data/table.hpp"

namespace wheelhop {

/// Reads real vectors (row or column; double, single, integer or logical) of equal length.
/// @param wanted names of the variables; empty = every variable of the file, none of which may be anything else.
/// UserError naming file and variable: missing (lists those there), complex, not numeric, not a vector, of another
/// length than the first, not finite, shorter than it declares, or packed beyond what ReadLimits allows; UserError
/// naming the file if it is no MAT file or is not whole. Source: MathWorks, MAT-File Format (2023), chapter 1.
/// @param finite whether values that are not finite are refused
Table read_mat(const std::filesystem::path& file, const std::vector<std::string>& wanted = {}, bool finite = true);

/// The variables that are real vectors of the length that most values have, whatever else the file holds; finite or
/// not. UserError as above where there is none.
Table read_mat_vectors(const std::filesystem::path& file);

/// Writes each channel as a column vector of doubles. All or nothing, and the same bytes every time.
/// UserError if a name is no MATLAB name (letter, then letters, digits, underscores; at most 63) or appears twice.
void write_mat(const std::filesystem::path& file, const Table& table);

}  // namespace wheelhop
