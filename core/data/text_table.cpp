#include "core/data/text_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "core/data/instant.hpp"

namespace wheelhop {
namespace {

constexpr std::size_t kKeptFaults = 10000;
constexpr double kHalfDay = 43200, kWholeDay = 86400;

/// The cells of a column of instants as seconds.
class Clock {
 public:
  /// @return why it is no instant; empty if it is one
  std::string read(std::string_view cell, double& seconds) {
    const auto instant = find_instant(cell);
    if (!instant) return cell.empty() ? "found an empty cell" : fmt::format("found \"{}\"", excerpt(cell));
    if (!first_) first_ = instant;
    if (instant->dated != first_->dated) return fmt::format("found \"{}\", with a date or without", excerpt(cell));
    if (instant->day_or_month && instant->day != first_->day)
      return fmt::format("found \"{}\" behind another date: which of its numbers is the day cannot be told",
                         excerpt(cell));
    seconds = seconds_since(*instant, first_->day) + turns_;
    if (!instant->dated && seconds < last_ - kHalfDay) {
      turns_ += kWholeDay;
      seconds += kWholeDay;
    }
    last_ = seconds;
    return "";
  }

 private:
  std::optional<Instant> first_;
  double turns_ = 0, last_ = -std::numeric_limits<double>::infinity();
};

class TextTableReader {
 public:
  TextTableReader(const TextLayout& layout, const std::vector<WantedColumn>& wanted)
      : layout_(layout), wanted_(wanted), rows_of_(layout.names.size(), -1), clocks_(wanted.size()) {
    for (std::size_t i = 0; i < wanted.size(); ++i) {
      Index& row = rows_of_[wanted[i].place];
      if (row < 0)
        row = static_cast<Index>(i);
      else
        copies_.emplace_back(static_cast<std::size_t>(row), i);
    }
  }

  TextTable read(std::string_view text) {
    values_.reserve(text.size() / (8 * std::max<std::size_t>(layout_.names.size(), 1)) * wanted_.size());
    Lines lines(text);
    for (std::string_view line; lines.next(line);) {
      if (lines.number() < layout_.first_line || is_comment(line)) continue;
      if (table_.lines.empty() || lines.number() - samples_ != table_.lines.back().second)
        table_.lines.emplace_back(samples_, lines.number() - samples_);
      values_.resize(values_.size() + wanted_.size(), std::numeric_limits<double>::quiet_NaN());
      read_row(line, lines.number(), values_.data() + values_.size() - wanted_.size());
      ++samples_;
    }
    table_.columns = Eigen::Map<const Matrix>(values_.data(), static_cast<Index>(wanted_.size()), samples_);
    return std::move(table_);
  }

 private:
  bool is_comment(std::string_view line) const {
    if (layout_.comments.empty()) return false;
    line = line.substr(std::min(line.find_first_not_of(" \t"), line.size()));
    return std::any_of(layout_.comments.begin(), layout_.comments.end(),
                       [&](const std::string& mark) { return line.starts_with(mark); });
  }

  void fault(Index line, std::size_t column, std::string what) {
    if (table_.faults.size() < kKeptFaults) table_.faults.try_emplace(samples_, CellFault{line, column, what});
  }

  void read_row(std::string_view line, Index number, double* row) {
    const std::size_t columns = layout_.names.size();
    if (trim(line).empty()) return fault(number, 1, "expected a sample, found a blank line");
    Cells cells(line, layout_.separator);
    std::size_t k = 0, surplus = 0;
    for (std::string_view cell; cells.next(cell); ++k) {
      if (k >= columns) {
        if (surplus == 0 && !(layout_.trailing && cell.empty())) surplus = cells.start() + 1;
        continue;
      }
      const Index i = rows_of_[k];
      if (i >= 0) read_cell(trim(cell), number, cells.start() + 1, static_cast<std::size_t>(i), row[i]);
    }
    for (const auto& [from, to] : copies_) row[to] = row[from];
    if (k >= columns && surplus == 0) return;
    std::fill(row, row + wanted_.size(), std::numeric_limits<double>::quiet_NaN());
    table_.faults.erase(samples_);  // cells that stand where they do not belong are not the reason
    fault(number, surplus > 0 ? surplus : line.size() - (line.ends_with('\r') ? 1 : 0) + 1,
          fmt::format("expected {} cells, found {}", columns, k));
  }

  void read_cell(std::string_view cell, Index line, std::size_t column, std::size_t i, double& value) {
    const auto name = [&] { return excerpt(layout_.names[wanted_[i].place]); };
    double read = 0;
    if (wanted_[i].instants) {
      const std::string found = clocks_[i].read(cell, read);
      if (!found.empty())
        return fault(line, column, fmt::format("expected a date and time for \"{}\", {}", name(), found));
    } else if (!parse_number(cell, layout_.numbers, read)) {
      return fault(line, column,
                   fmt::format("expected a number for \"{}\", found {}{}", name(),
                               cell.empty() ? "an empty cell" : fmt::format("\"{}\"", excerpt(cell)), hint(cell)));
    } else if (!std::isfinite(read)) {
      return fault(line, column, fmt::format("expected a finite number for \"{}\", found {}", name(), excerpt(cell)));
    }
    value = read;
  }

  /// What a cell that would be a number in another layout asks for.
  std::string hint(std::string_view cell) const {
    double ignored = 0;
    const char decimal = layout_.numbers.decimal, other = decimal == '.' ? ',' : '.';
    if (cell.find(other) == std::string_view::npos) return "";
    if (parse_number(cell, {decimal, other}, ignored))
      return fmt::format("; if \"{}\" stands between thousands, say \"format\": {{\"thousands\": \"{}\"}}", other,
                         other);
    if (parse_number(cell, {other, '\0'}, ignored))
      return fmt::format("; if \"{}\" is the decimal mark, say \"format\": {{\"decimal\": \"{}\"}}", other, other);
    return "";
  }

  const TextLayout& layout_;
  const std::vector<WantedColumn>& wanted_;
  std::vector<Index> rows_of_;                               ///< by column; -1: not wanted
  std::vector<std::pair<std::size_t, std::size_t>> copies_;  ///< rows that want the column of another one
  std::vector<Clock> clocks_;
  std::vector<double> values_;
  TextTable table_;
  Index samples_ = 0;
};

}  // namespace

Index TextTable::line_of(Index sample) const {
  Index offset = 0;
  for (const auto& [first, own] : lines)
    if (first <= sample) offset = own;
  return sample + offset;
}

void TextTable::require_sound(Index first, Index last, const std::string& source) const {
  const auto place = faults.lower_bound(first);
  if (place != faults.end() && place->first < last)
    fail_in_text(source, place->second.line, place->second.column, place->second.what);
  for (Index k = first; k < last && faults.size() == kKeptFaults; ++k)
    if (!columns.col(k).allFinite()) fail_in_text(source, line_of(k), 1, "expected finite numbers, found none");
}

TextTable read_text_table(std::string_view text, const TextLayout& layout, const std::vector<WantedColumn>& wanted) {
  return TextTableReader(layout, wanted).read(text);
}

}  // namespace wheelhop
