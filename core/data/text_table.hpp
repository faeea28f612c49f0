/// \file
/// Columns of numbers out of a text with a layout. What is not asked for is not judged.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/linalg.hpp"
#include "core/data/text_layout.hpp"

namespace wheelhop {

/// A column that is wanted.
struct WantedColumn {
  std::size_t place = 0;  ///< among the columns of the layout, from 0
  bool instants = false;  ///< its cells are dates and times, read as seconds (instant.hpp)
};

/// Why a row gives no number where one is wanted.
struct CellFault {
  Index line = 0;          ///< from 1
  std::size_t column = 0;  ///< position of the character in its line, from 1
  std::string what;
};

struct TextTable {
  Matrix columns;                              ///< wanted x samples; NaN where a cell is no finite number
  std::map<Index, CellFault> faults;           ///< the first fault of a sample, of the first 10000 samples with one
  std::vector<std::pair<Index, Index>> lines;  ///< from sample `first` on, sample k stands in line k + `second`

  /// Line of a sample, from 1.
  Index line_of(Index sample) const;
  /// UserError naming line and column of the first fault among the samples [first, last).
  void require_sound(Index first, Index last, const std::string& source) const;
};

/// Reads the wanted columns of every sample. Lines that begin with a comment mark are passed over; a blank line counts
/// as a sample with a fault, and so does one with more or fewer cells than the layout has columns. Instants count from
/// the midnight before the first of them; a time without a date goes on behind midnight.
/// Cost: about 30 ns a cell where separator and numbers are plain.
TextTable read_text_table(std::string_view text, const TextLayout& layout, const std::vector<WantedColumn>& wanted);

}  // namespace wheelhop
