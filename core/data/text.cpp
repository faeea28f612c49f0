#include "core/data/text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdlib>

#include "core/base/status.hpp"

namespace wheelhop {
namespace {

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r'; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// A mark between thousands stands behind a digit and before exactly three.
bool between_thousands(std::string_view cell, std::size_t place) {
  if (place == 0 || !is_digit(cell[place - 1]) || place + 3 >= cell.size()) return false;
  for (std::size_t i = place + 1; i <= place + 3; ++i)
    if (!is_digit(cell[i])) return false;
  return place + 4 == cell.size() || !is_digit(cell[place + 4]);
}

}  // namespace

std::string_view trim(std::string_view text) {
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

std::string excerpt(std::string_view text) {
  std::string result;
  for (const char c : text.substr(0, 40)) result += static_cast<unsigned char>(c) < 32 || c == 127 ? '?' : c;
  return text.size() > 40 ? result + "..." : result;
}

void fail_in_text(const std::string& source, Index line, std::size_t column, const std::string& what) {
  throw UserError(fmt::format("{}: line {}, column {}: {}", source, line, column, what));
}

Lines::Lines(std::string_view text) : text_(text) {
  if (text_.starts_with("\xef\xbb\xbf")) text_.remove_prefix(3);
  const std::size_t last = text_.find_last_not_of(" \t\r\n");
  text_ = text_.substr(0, last == std::string_view::npos ? 0 : last + 1);
  if (text_.find('\n') == std::string_view::npos && text_.find('\r') != std::string_view::npos) end_ = '\r';
}

bool Lines::next(std::string_view& line) {
  if (place_ >= text_.size()) return false;
  const std::size_t end = std::min(text_.find(end_, place_), text_.size());
  line = text_.substr(place_, end - place_);
  place_ = end + 1;
  ++number_;
  return true;
}

Cells::Cells(std::string_view line, char separator) : line_(line), separator_(separator) {
  if (separator_ != ' ') return;
  line_ = line_.substr(0, line_.find_last_not_of(" \t\r") + 1);
  while (place_ < line_.size() && is_blank(line_[place_])) ++place_;
  ended_ = place_ == line_.size();
}

std::size_t Cells::end_of_cell() {
  std::size_t place = start_;
  while (place < line_.size() && line_[place] == ' ' && separator_ != ' ') ++place;
  if (place < line_.size() && line_[place] == '"') {
    // Two quotes inside stand for one.
    open_ = true;
    for (++place; place < line_.size() && open_; ++place)
      if (line_[place] == '"') {
        if (place + 1 < line_.size() && line_[place + 1] == '"')
          ++place;
        else
          open_ = false;
      }
  } else {
    place = start_;
  }
  return std::min(separator_ == ' ' ? line_.find_first_of(" \t", place) : line_.find(separator_, place), line_.size());
}

bool Cells::next(std::string_view& cell) {
  if (ended_) return false;
  start_ = place_;
  const std::size_t end = end_of_cell();
  cell = trim(line_.substr(start_, end - start_));
  if (cell.size() >= 2 && cell.front() == '"' && cell.back() == '"') cell = cell.substr(1, cell.size() - 2);
  place_ = end + 1;
  if (separator_ == ' ')
    while (place_ < line_.size() && is_blank(line_[place_])) ++place_;
  ended_ = separator_ == ' ' ? place_ >= line_.size() : end == line_.size();
  return true;
}

std::string unescape_quotes(std::string_view cell) {
  std::string text(cell);
  for (std::size_t i = 0; (i = text.find("\"\"", i)) != std::string::npos; ++i) text.erase(i, 1);
  return text;
}

bool parse_number(std::string_view cell, double& value) {
  if (!cell.empty() && cell.front() == '+') cell.remove_prefix(1);
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  if (end != cell.data() + cell.size() || cell.empty()) return false;
  if (error == std::errc::result_out_of_range) {
    // Too small a number is 0; too large a one becomes infinite and is refused.
    value = std::strtod(std::string(cell).c_str(), nullptr);
    return true;
  }
  return error == std::errc();
}

bool parse_number(std::string_view cell, NumberFormat format, double& value) {
  if (format.plain()) return parse_number(cell, value);
  std::array<char, 128> plain;
  if (cell.size() > plain.size()) return false;
  std::size_t length = 0;
  bool whole = true;  // before the decimal mark
  for (std::size_t i = 0; i < cell.size(); ++i) {
    const char c = cell[i];
    if (c == format.thousands && c != '\0') {
      if (!whole || !between_thousands(cell, i)) return false;
      continue;
    }
    if (c == format.decimal) {
      // A comma at the end ends the cell of another layout, not a number.
      if (c == ',' && i + 1 == cell.size()) return false;
      whole = false;
    } else if (c == '.' || c == ',') {
      return false;
    }
    plain[length++] = c == format.decimal ? '.' : c;
  }
  return parse_number(std::string_view(plain.data(), length), value);
}

}  // namespace wheelhop
