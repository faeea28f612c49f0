/// \file
/// Lines, cells and numbers of a text that holds a table.
#pragma once

#include <string>
#include <string_view>

#include "core/base/linalg.hpp"

namespace wheelhop {

/// Without blanks, tabs and carriage returns at both ends.
std::string_view trim(std::string_view text);

/// A piece of the text for a message, without control characters.
std::string excerpt(std::string_view text);

/// Throws UserError "SOURCE: line L, column C: WHAT"; both count from 1, a column is the position of a character.
[[noreturn]] void fail_in_text(const std::string& source, Index line, std::size_t column, const std::string& what);

/// The lines of a text, one after the other: without a byte order mark in front and blank lines at the end. A line ends
/// with LF, or with CR where the text holds no LF.
class Lines {
 public:
  explicit Lines(std::string_view text);
  bool next(std::string_view& line);        ///< false at the end
  Index number() const { return number_; }  ///< of the line that came last, from 1

 private:
  std::string_view text_;
  std::size_t place_ = 0;
  char end_ = '\n';
  Index number_ = 0;
};

/// The cells of a line: without blanks around them, and then without quotes around those. A separator inside quotes
/// belongs to the cell. The separator ' ' stands for any number of blanks and tabs.
class Cells {
 public:
  Cells(std::string_view line, char separator);
  bool next(std::string_view& cell);            ///< false behind the last one
  std::size_t start() const { return start_; }  ///< of the cell that came last, from 0
  bool open() const { return open_; }           ///< a quote was never closed

 private:
  std::size_t end_of_cell();
  std::string_view line_;
  char separator_;
  std::size_t place_ = 0, start_ = 0;
  bool ended_ = false, open_ = false;
};

/// A cell with its doubled quotes as single ones.
std::string unescape_quotes(std::string_view cell);

/// How numbers are written.
struct NumberFormat {
  char decimal = '.';     ///< '.' or ','
  char thousands = '\0';  ///< between groups of three digits; none if NUL
  bool plain() const { return decimal == '.' && thousands == '\0'; }
};

/// Reads a cell as a number, which may come out infinite or NaN. False if it is none: a mark that the format does not
/// know, groups that are not of three digits, anything behind the number.
bool parse_number(std::string_view cell, double& value);
bool parse_number(std::string_view cell, NumberFormat format, double& value);

}  // namespace wheelhop
