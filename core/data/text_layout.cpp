#include "core/data/text_layout.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>

#include "core/base/status.hpp"
#include "core/data/instant.hpp"
#include "core/data/units.hpp"

namespace wheelhop {
namespace {

// Judgements: lines that show a layout, the last part of them that is taken for samples, rows of names above those.
constexpr std::size_t kShown = 400, kSurePart = 4, kMostSure = 100, kNameRows = 4;

struct LayoutLine {
  Index number;
  std::string_view text;  ///< without its comment mark
  bool comment;
};

enum class Kind { number, instant, missing, text };

Kind kind_of(std::string_view cell, NumberFormat numbers) {
  double value = 0;
  cell = trim(cell);
  if (parse_number(cell, numbers, value)) return std::isfinite(value) ? Kind::number : Kind::missing;
  if (find_instant(cell)) return Kind::instant;
  if (cell.find_first_not_of("-") == std::string_view::npos) return Kind::missing;  // empty, too
  std::string word(cell);
  for (char& c : word) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  for (const char* missing : {"na", "n/a", "#n/a", "null", "none", "invalid", "overflow", "ovl", "-inf", "+nan"})
    if (word == missing) return Kind::missing;
  return Kind::text;
}

bool holds_numbers(Kind kind) { return kind == Kind::number || kind == Kind::instant; }

std::vector<std::string_view> cells_of(std::string_view line, char separator) {
  std::vector<std::string_view> result;
  Cells cells(line, separator);
  for (std::string_view cell; cells.next(cell);) result.push_back(cell);
  return result;
}

/// "1,234" may be two numbers, "1,2345", "0,123" and "1234,567" are one each.
enum class Mark { none, open, settled };
Mark mark_of(std::string_view cell, char mark) {
  if (!cell.empty() && (cell.front() == '-' || cell.front() == '+')) cell.remove_prefix(1);
  const std::size_t place = cell.find(mark);
  if (place == std::string_view::npos) return Mark::none;
  const auto digits = [](std::string_view text) {
    return text.find_first_not_of("0123456789") == std::string_view::npos;
  };
  if (!digits(cell.substr(0, place)) || place == 0 || place > 3 || cell.front() == '0') return Mark::settled;
  std::string_view rest = cell.substr(place + 1);
  while (rest.size() > 3 && rest[3] == mark && digits(rest.substr(0, 3))) rest.remove_prefix(4);
  return rest.size() == 3 && digits(rest) ? Mark::open : Mark::settled;
}

/// One way to read the lines.
struct Candidate {
  TextLayout layout;
  std::vector<Kind> kinds;  ///< of the columns
  Index numeric = 0;        ///< columns that hold numbers or instants
  std::string problem;      ///< empty where it can be read so
};

class LayoutReader {
 public:
  LayoutReader(const std::vector<LayoutLine>& lines, const LayoutHints& hints, const std::vector<std::string>& wanted)
      : lines_(lines), hints_(hints), wanted_(wanted) {}

  Candidate read(char separator, NumberFormat numbers) const {
    Candidate found;
    found.layout.separator = separator;
    found.layout.numbers = numbers;
    const std::size_t sure = sure_samples();
    if (sure == lines_.size()) {
      found.problem = "expected rows of numbers, found none";
      return found;
    }
    std::vector<bool> empty;
    const std::size_t width = columns_of(sure, found, empty);
    if (found.numeric == 0) {
      found.problem =
          fmt::format("line {}: expected numbers, found \"{}\"", lines_[sure].number, excerpt(lines_[sure].text));
      return found;
    }
    const std::size_t first = first_sample(sure, found);
    found.layout.first_line = lines_[first].number;
    find_names(first, width, empty, found);
    return found;
  }

 private:
  bool is_row(std::size_t i) const { return !lines_[i].comment && !trim(lines_[i].text).empty(); }
  bool above_samples(Index line) const {
    return line < hints_.first_row.value_or(1) || line <= hints_.header_row.value_or(0) ||
           line <= hints_.unit_row.value_or(0);
  }

  /// First of the lines at the end that are surely samples; the number of lines if there is none.
  std::size_t sure_samples() const {
    std::vector<std::size_t> rows;
    for (std::size_t i = 0; i < lines_.size(); ++i)
      if (is_row(i) && !above_samples(lines_[i].number)) rows.push_back(i);
    if (rows.empty()) return lines_.size();
    return rows[rows.size() - std::clamp<std::size_t>(rows.size() / kSurePart, 1, kMostSure)];
  }

  /// Kinds of the columns by the sure samples: what most cells hold that hold anything. @return cells of a row
  std::size_t columns_of(std::size_t sure, Candidate& found, std::vector<bool>& empty) const {
    std::vector<std::vector<std::string_view>> rows;
    std::map<std::size_t, int> widths;
    for (std::size_t i = sure; i < lines_.size(); ++i)
      if (is_row(i)) {
        rows.push_back(cells_of(lines_[i].text, found.layout.separator));
        ++widths[rows.back().size()];
      }
    const std::size_t width = std::max_element(widths.begin(), widths.end(), [](const auto& a, const auto& b) {
                                return a.second < b.second;
                              })->first;
    for (std::size_t j = 0; j < width; ++j) {
      std::map<Kind, int> counts;
      bool bare = true;
      for (const auto& row : rows)
        if (row.size() == width) {
          ++counts[kind_of(row[j], found.layout.numbers)];
          bare = bare && row[j].empty();
        }
      empty.push_back(bare);
      Kind kind = Kind::missing;
      for (const Kind other : {Kind::number, Kind::instant, Kind::text})
        if (counts[other] > 0 && (kind == Kind::missing || counts[other] > counts[kind])) kind = other;
      found.kinds.push_back(kind);
      found.numeric += holds_numbers(kind);
    }
    return width;
  }

  bool is_sample(std::string_view line, const Candidate& found) const {
    const auto cells = cells_of(line, found.layout.separator);
    Index held = 0, missing = 0;
    for (std::size_t j = 0; j < std::min(cells.size(), found.kinds.size()); ++j) {
      if (!holds_numbers(found.kinds[j])) continue;
      const Kind kind = kind_of(cells[j], found.layout.numbers);
      held += kind == found.kinds[j];
      missing += kind == Kind::missing;
    }
    return held > 0 && 2 * (held + missing) >= found.numeric;
  }

  std::size_t first_sample(std::size_t sure, const Candidate& found) const {
    std::size_t first = sure;
    for (std::size_t i = sure; i-- > 0;) {
      if (above_samples(lines_[i].number)) break;
      if (!is_row(i)) continue;
      if (!hints_.first_row && !is_sample(lines_[i].text, found)) break;
      first = i;
    }
    return first;
  }

  /// May a line hold the names (or units) of `width` columns?
  static bool fits(const std::vector<std::string_view>& cells, std::size_t width, const std::vector<bool>& empty) {
    for (std::size_t j = width; j < cells.size(); ++j)
      if (!cells[j].empty()) return false;
    for (std::size_t j = cells.size(); j < width; ++j)
      if (!empty[j]) return false;
    return std::any_of(cells.begin(), cells.end(), [](std::string_view cell) { return !cell.empty(); });
  }

  static bool are_units(const std::vector<std::string_view>& cells) {
    std::size_t known = 0, told = 0;
    for (const std::string_view cell : cells)
      if (!cell.empty()) {
        ++told;
        known += find_unit(cell).has_value() || cell == "()" || cell == "[]";
      }
    return told > 0 && 2 * known >= told;
  }

  std::size_t wanted_in(const std::vector<std::string_view>& cells) const {
    std::size_t count = 0;
    for (const std::string_view cell : cells) {
      const std::string name = unescape_quotes(cell);
      count += std::find(wanted_.begin(), wanted_.end(), name) != wanted_.end() ||
               std::find(wanted_.begin(), wanted_.end(), split_name(name).base) != wanted_.end();
    }
    return count;
  }

  const LayoutLine* line_called(Index number) const {
    const auto place =
        std::find_if(lines_.begin(), lines_.end(), [&](const LayoutLine& line) { return line.number == number; });
    return place == lines_.end() ? nullptr : &*place;
  }

  /// Lines right above the samples that may hold names or units, the lowest first.
  std::vector<std::size_t> name_rows(std::size_t first, std::size_t width, const std::vector<bool>& empty,
                                     const Candidate& found) const {
    std::vector<std::size_t> rows;
    for (std::size_t i = first; i-- > 0 && rows.size() < kNameRows;) {
      if (trim(lines_[i].text).empty()) continue;
      const auto cells = cells_of(lines_[i].text, found.layout.separator);
      if (fits(cells, width, empty))
        rows.push_back(i);
      else if (!lines_[i].comment)
        break;
    }
    return rows;
  }

  void find_names(std::size_t first, std::size_t width, const std::vector<bool>& empty, Candidate& found) const {
    TextLayout& layout = found.layout;
    const auto cells = [&](std::size_t i) { return cells_of(lines_[i].text, layout.separator); };
    const std::vector<std::size_t> rows = name_rows(first, width, empty, found);
    std::vector<std::string_view> names, units;
    layout.header_line = layout.unit_line = 0;
    if (hints_.header_row && *hints_.header_row > 0) {
      const LayoutLine* line = line_called(*hints_.header_row);
      if (line) names = cells_of(line->text, layout.separator);
      if (!line || !fits(names, width, empty)) {
        found.problem = fmt::format("line {}: expected {} names as the rows below have cells, found {}",
                                    *hints_.header_row, width, names.size());
        return;
      }
      layout.header_line = *hints_.header_row;
    } else if (!hints_.header_row) {
      std::size_t best = rows.size(), most = 0;
      for (std::size_t i = 0; i < rows.size(); ++i) {
        const std::size_t count = wanted_in(cells(rows[i]));
        if (count > most || (best == rows.size() && !are_units(cells(rows[i])))) best = i;
        most = std::max(most, count);
      }
      if (best == rows.size() && !rows.empty()) best = 0;
      if (rows.empty()) {
        found.problem = no_names(first, width, found);
        return;
      }
      names = cells(rows[best]);
      layout.header_line = lines_[rows[best]].number;
    }
    if (hints_.unit_row) {
      layout.unit_line = *hints_.unit_row;
      if (const LayoutLine* line = line_called(*hints_.unit_row)) units = cells_of(line->text, layout.separator);
    } else {
      // Below the names whatever it holds, so that a unit that nobody knows is not overlooked; above, if it is units.
      for (const std::size_t i : rows)
        if (layout.unit_line == 0 &&
            (lines_[i].number > layout.header_line || (lines_[i].number < layout.header_line && are_units(cells(i))))) {
          layout.unit_line = lines_[i].number;
          units = cells(i);
        }
    }
    std::size_t columns = width;
    if (layout.header_line > 0)
      while (columns > 0 && (columns > names.size() || (names[columns - 1].empty() && empty[columns - 1]))) --columns;
    layout.trailing = columns < width;
    for (std::size_t j = 0; j < columns; ++j) {
      layout.names.push_back(layout.header_line > 0 ? unescape_quotes(names[j]) : fmt::format("{}", j + 1));
      if (layout.unit_line > 0) layout.units.push_back(j < units.size() ? unescape_quotes(units[j]) : "");
    }
    found.kinds.resize(columns);
    for (const Kind kind : found.kinds) layout.instants.push_back(kind == Kind::instant);
  }

  std::string no_names(std::size_t first, std::size_t width, const Candidate& found) const {
    const LayoutLine* above = nullptr;
    for (std::size_t i = first; i-- > 0 && !above;)
      if (is_row(i)) above = &lines_[i];
    if (above)
      return fmt::format("line {}: expected {} names as the rows below have cells, found {}", above->number, width,
                         cells_of(above->text, found.layout.separator).size());
    return fmt::format(
        "line {}: expected a row of names above the samples, found \"{}\"; say \"format\": {{\"header_row\": 0}} and "
        "name columns by number, as in \"columns\": {{\"acc\": 2}}, where there are no names, or which row holds them",
        lines_[first].number, excerpt(lines_[first].text));
  }

  const std::vector<LayoutLine>& lines_;
  const LayoutHints& hints_;
  const std::vector<std::string>& wanted_;
};

std::vector<LayoutLine> first_lines(std::string_view text, const LayoutHints& hints,
                                    const std::vector<std::string>& comments, const std::string& source) {
  const auto most = std::max({static_cast<Index>(kShown), 50 + hints.header_row.value_or(0),
                              50 + hints.unit_row.value_or(0), 50 + hints.first_row.value_or(0)});
  std::vector<LayoutLine> lines;
  Lines rest(text);
  for (std::string_view line; rest.number() < most && rest.next(line);) {
    const auto binary = std::find_if(line.begin(), line.end(),
                                     [](unsigned char c) { return (c < 32 && c != '\t' && c != '\r') || c == 127; });
    if (binary != line.end())
      fail_in_text(source, rest.number(), static_cast<std::size_t>(binary - line.begin()) + 1,
                   "expected a line of names, found binary content");
    const std::string_view bare = trim(line);
    const auto mark =
        std::find_if(comments.begin(), comments.end(), [&](const std::string& own) { return bare.starts_with(own); });
    // A separator at the end of a line is a blank in some layouts and stays.
    lines.push_back(mark == comments.end() ? LayoutLine{rest.number(), line, false}
                                           : LayoutLine{rest.number(), trim(bare.substr(mark->size())), true});
  }
  return lines;
}

/// Refuses a mark that nothing in the text tells from one between thousands.
void require_settled_mark(std::string_view text, const Candidate& found, const std::string& source) {
  const TextLayout& layout = found.layout;
  const char mark = layout.numbers.decimal;
  // Points between commas are decimal: where commas separate, nobody writes points between thousands.
  if (mark == '.' && layout.separator != ';') return;
  Lines lines(text);
  Index open_line = 0;
  std::size_t open_column = 0;
  std::string open;
  for (std::string_view line; lines.next(line);) {
    if (lines.number() < layout.first_line) continue;
    Cells cells(line, layout.separator);
    std::size_t j = 0;
    for (std::string_view cell; cells.next(cell) && j < found.kinds.size(); ++j) {
      if (found.kinds[j] != Kind::number) continue;
      const Mark kind = mark_of(cell, mark);
      if (kind == Mark::settled) return;
      if (kind == Mark::open && open_line == 0) {
        open_line = lines.number();
        open_column = cells.start() + 1;
        open = excerpt(cell);
      }
    }
  }
  if (open_line > 0)
    fail_in_text(source, open_line, open_column,
                 fmt::format("\"{}\" may have a decimal mark or one between thousands, and no other number tells; say "
                             "\"format\": {{\"decimal\": \"{}\"}} or \"format\": {{\"thousands\": \"{}\"}}",
                             open, mark, mark));
}

Candidate best_of(const std::vector<Candidate>& all, const std::string& source) {
  const Candidate *best = nullptr, *nearest = &all.front();
  for (const Candidate& one : all) {
    if (one.problem.empty() && (!best || one.numeric > best->numeric)) best = &one;
    if (one.numeric > nearest->numeric) nearest = &one;
  }
  if (!best)
    throw UserError(fmt::format("{}: {}{}", source, nearest->problem,
                                nearest->problem.find("\"format\"") != std::string::npos
                                    ? ""
                                    : "; if it is a table, say how it is written, as in \"format\": {\"separator\": "
                                      "\";\", \"decimal\": \",\", \"header_row\": 5}"));
  for (const Candidate& one : all)
    if (&one != best && one.problem.empty() && one.numeric == best->numeric &&
        one.layout.separator == best->layout.separator && one.kinds != best->kinds)
      throw UserError(fmt::format(
          "{}: some columns write decimals with \".\" and as many with \",\"; say which mark is decimal, as "
          "in \"format\": {{\"decimal\": \",\"}}, or \"format\": {{\"thousands\": \",\"}} for the other one",
          source));
  return *best;
}

}  // namespace

ColumnName split_name(const std::string& name) {
  const auto split_at = [&](std::size_t place, std::string_view unit) {
    std::string_view base = trim(std::string_view(name).substr(0, place));
    if (base.ends_with('/')) base = trim(base.substr(0, base.size() - 1));
    return base.empty() ? ColumnName{name, ""} : ColumnName{std::string(base), std::string(trim(unit))};
  };
  const std::string_view whole = trim(name);
  if (whole.ends_with(']') || whole.ends_with(')')) {
    const char close = whole.back(), open = close == ']' ? '[' : '(';
    int depth = 0;
    for (std::size_t i = whole.size(); i-- > 0;) {
      depth += (whole[i] == close) - (whole[i] == open);
      if (depth == 0)
        return split_at(static_cast<std::size_t>(whole.data() - name.data()) + i,
                        whole.substr(i + 1, whole.size() - i - 2));
    }
  }
  const std::size_t slash = name.find(" / ");
  if (slash != std::string::npos && find_unit(std::string_view(name).substr(slash + 3)))
    return split_at(slash, std::string_view(name).substr(slash + 3));
  return {name, ""};
}

LayoutHints read_layout_hints(const JsonCursor& cursor) {
  if (!cursor.is_object()) cursor.fail("an object that says how the file is written");
  LayoutHints hints;
  const auto sign = [&](const char* key, const std::vector<std::string>& known) -> std::optional<char> {
    const auto value = cursor.find(key);
    if (!value) return {};
    const std::string text = value->one_of(known);
    return text == "tab" ? '\t' : text == "space" ? ' ' : text.front();
  };
  hints.separator = sign("separator", {",", ";", "|", "tab", "space", "\t", " "});
  hints.decimal = sign("decimal", {".", ","});
  hints.thousands = sign("thousands", {",", ".", "'", " "});
  if (hints.thousands && hints.thousands == hints.decimal)
    cursor.at("thousands").fail("another mark than that of the decimals");
  if (const auto comment = cursor.find("comment")) hints.comment = comment->string();
  const auto row = [&](const char* key, Index least) -> std::optional<Index> {
    const auto value = cursor.find(key);
    if (!value) return {};
    return value->integer(least, 1000000);
  };
  hints.header_row = row("header_row", 0);
  hints.unit_row = row("unit_row", 0);
  hints.first_row = row("first_row", 1);
  cursor.done();
  return hints;
}

Json layout_json(const TextLayout& layout) {
  Json out = Json::object();
  const char separator = layout.separator;
  if (separator != ',')
    out["separator"] = separator == '\t' ? "tab" : separator == ' ' ? "space" : std::string(1, separator);
  if (layout.numbers.decimal != '.') out["decimal"] = std::string(1, layout.numbers.decimal);
  if (layout.numbers.thousands != '\0') out["thousands"] = std::string(1, layout.numbers.thousands);
  if (layout.header_line != 1) out["header_row"] = layout.header_line;
  if (layout.unit_line != 0) out["unit_row"] = layout.unit_line;
  if (layout.first_line != std::max(layout.header_line, layout.unit_line) + 1) out["first_row"] = layout.first_line;
  return out;
}

std::vector<std::string> layout_told(const TextLayout& layout) {
  std::vector<std::string> told;
  const char separator = layout.separator;
  if (separator == '\t' || separator == ' ')
    told.emplace_back(separator == ' ' ? "cells separated by blanks" : "cells separated by tabs");
  else if (separator != ',')
    told.push_back(fmt::format("cells separated by \"{}\"", separator));
  if (layout.numbers.decimal != '.') told.emplace_back("decimal comma");
  if (layout.numbers.thousands != '\0')
    told.push_back(fmt::format("\"{}\" between thousands left out", layout.numbers.thousands));
  if (layout.header_line == 0) told.emplace_back("no row of names: columns by number");
  if (layout.header_line > 1) told.push_back(fmt::format("names in line {}", layout.header_line));
  if (layout.unit_line > 0) told.push_back(fmt::format("units in line {}", layout.unit_line));
  return told;
}

TextLayout find_layout(std::string_view text, const LayoutHints& hints, const std::vector<std::string>& wanted,
                       const std::string& source) {
  if (text.starts_with("\xff\xfe") || text.starts_with("\xfe\xff"))
    throw UserError(source + ": expected text in UTF-8 or Latin-1, found UTF-16; save it as CSV in UTF-8");
  const std::vector<std::string> comments =
      !hints.comment ? std::vector<std::string>{"#", "%", "//", "!"}
                     : (hints.comment->empty() ? std::vector<std::string>{} : std::vector{*hints.comment});
  const std::vector<LayoutLine> lines = first_lines(text, hints, comments, source);
  if (lines.empty()) throw UserError(source + ": expected a line of names, found an empty file");
  const std::vector<char> separators =
      hints.separator ? std::vector{*hints.separator} : std::vector{',', ';', '\t', '|', ' '};
  std::vector<char> decimals = {'.', ','};
  if (hints.decimal) decimals = {*hints.decimal};
  if (!hints.decimal && hints.thousands) decimals = {hints.thousands == '.' ? ',' : '.'};
  const LayoutReader reader(lines, hints, wanted);
  std::vector<Candidate> all;
  for (const char separator : separators)
    for (const char decimal : decimals) {
      all.push_back(reader.read(separator, {decimal, hints.thousands.value_or('\0')}));
      all.back().layout.comments = comments;
      // Every column holds numbers under names: nothing else can hold more.
      if (all.size() == 1 && separator == ',' && decimal == '.' && all.back().problem.empty() &&
          all.back().numeric == static_cast<Index>(all.back().layout.names.size()))
        return all.back().layout;
    }
  const Candidate best = best_of(all, source);
  if (!hints.decimal && !hints.thousands) require_settled_mark(text, best, source);
  return best.layout;
}

}  // namespace wheelhop
