/// \file
/// Comma-separated values: one header line of names, then one line a sample.
#pragma once

#include <filesystem>
#include <string>

#include "core/data/table.hpp"

namespace wheelhop {

/// Reads a `.csv`, or a `.csv.gz` (by the ending). Tolerated: a byte order mark, CR LF, spaces around cells, quotes
/// around cells, blank lines at the end. Line i + 2 of the file is column i of the table.
/// UserError naming file, line and column: empty file, no header, repeated or empty name, no sample, blank line before
/// the end, more or fewer cells than names, a cell that is no finite number, a damaged or truncated gzip stream, binary
/// content. Cost: about 30 ns a cell.
Table read_csv(const std::filesystem::path& file);

/// Whole content of a text file, unpacked where its name ends in `.gz`.
std::string read_text(const std::filesystem::path& file);

/// `read_csv` of text in memory; `source` stands for the file in messages.
Table parse_csv(const std::string& text, const std::string& source);

/// Writes every double in the fewest digits that read back to the same bits; compressed where the name ends in `.gz`.
/// All or nothing, and the same bytes every time.
void write_csv(const std::filesystem::path& file, const Table& table);

}  // namespace wheelhop
