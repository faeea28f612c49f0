/// \file
/// How a text holds a table: separator, decimal mark, comments, rows of names and units; found, or given.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/json.hpp"
#include "core/data/text.hpp"

namespace wheelhop {

/// The whole layout. The default is the plain one: names in line 1, separated by commas, samples from line 2 on.
struct TextLayout {
  char separator = ',';  ///< ' ' stands for any number of blanks and tabs
  NumberFormat numbers;
  std::vector<std::string> comments;  ///< a line that begins with one of these is no sample
  Index header_line = 1;              ///< from 1; 0: the columns have no names
  Index unit_line = 0;                ///< from 1; 0: none
  Index first_line = 2;               ///< of the first sample
  bool trailing = false;              ///< a row may go on with empty cells behind its last column
  std::vector<std::string> names;  ///< of the columns; without a header their numbers, from 1; may repeat or be empty
  std::vector<std::string> units;  ///< as many, or none
  std::vector<bool> instants;      ///< as many: which columns hold dates and times
};

/// What a user says of it.
struct LayoutHints {
  std::optional<char> separator, decimal, thousands;
  std::optional<std::string> comment;
  std::optional<Index> header_row, unit_row, first_row;
};

/// Reads `{"separator": ",", ";", "|", "tab" or "space", "decimal": "." or ",", "thousands": ",", ".", "'" or " ",
/// "comment": "#", "header_row": 5, "unit_row": 6, "first_row": 7}`: lines count from 1, a `header_row` or `unit_row`
/// of 0 stands for none, and every member may be absent.
LayoutHints read_layout_hints(const JsonCursor& cursor);
/// The same members for what was found, without those that hold for a plain file.
Json layout_json(const TextLayout& layout);

/// The same for people, a phrase each: "decimal comma", "units in line 2".
std::vector<std::string> layout_told(const TextLayout& layout);

/// Finds what the hints leave open, from the first 400 lines: the layout in which most columns hold numbers under as
/// many names. Names stand in one of the rows right above the samples, commented out or not: in the one that holds most
/// of `wanted`, else in the lowest that is no row of units. UserError with line, and with the members of "format" that
/// settle it: no table; a row of names that does not fit the samples or may be a sample; decimal marks that may as well
/// stand between thousands, in all of the text.
TextLayout find_layout(std::string_view text, const LayoutHints& hints, const std::vector<std::string>& wanted,
                       const std::string& source);

/// A name as "acc" and "m/s^2" where it is written "acc [m/s^2]", "acc (m/s^2)" or "acc / (m/s^2)"; the unit is empty
/// where none is told.
struct ColumnName {
  std::string base, unit;
};
ColumnName split_name(const std::string& name);

}  // namespace wheelhop
