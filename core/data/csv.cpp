#include "core/data/csv.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <iterator>

#include "core/base/files.hpp"
#include "core/base/status.hpp"
#include "core/data/gzip.hpp"

namespace wheelhop {
namespace {

bool is_gzip_name(const std::filesystem::path& file) {
  const std::string ending = file.extension().string();
  return ending == ".gz" || ending == ".GZ";
}

/// Line and column count from 1; a column is the position of a character in its line.
[[noreturn]] void fail(const std::string& source, std::size_t line, std::size_t column, const std::string& what) {
  throw UserError(fmt::format("{}: line {}, column {}: {}", source, line, column, what));
}

std::string_view trim(std::string_view text) {
  const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
  while (!text.empty() && blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && blank(text.back())) text.remove_suffix(1);
  return text;
}

std::string_view unquote(std::string_view cell) {
  if (cell.size() >= 2 && cell.front() == '"' && cell.back() == '"') cell = cell.substr(1, cell.size() - 2);
  return cell;
}

/// A piece of the text for a message, without control characters.
std::string excerpt(std::string_view cell) {
  std::string result;
  for (char c : cell.substr(0, 40)) result += static_cast<unsigned char>(c) < 32 || c == 127 ? '?' : c;
  return cell.size() > 40 ? result + "..." : result;
}

/// Takes the line that starts at `place` and moves `place` behind it.
std::string_view next_line(const std::string& text, std::size_t& place) {
  const std::size_t end = std::min(text.find('\n', place), text.size());
  const std::string_view line(text.data() + place, end - place);
  place = std::min(end + 1, text.size());
  return line;
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

std::vector<std::string> parse_header(std::string_view line, const std::string& source) {
  const auto binary = std::find_if(line.begin(), line.end(),
                                   [](unsigned char c) { return (c < 32 && c != '\t' && c != '\r') || c == 127; });
  if (binary != line.end())
    fail(source, 1, static_cast<std::size_t>(binary - line.begin()) + 1,
         "expected a line of names, found binary content");
  std::vector<std::string> names;
  std::size_t numbers = 0;
  for (std::size_t start = 0; start <= line.size();) {
    // A comma inside quotes belongs to the name; two quotes stand for one.
    std::size_t end = start;
    bool quoted = false;
    while (end < line.size() && (quoted || line[end] != ',')) quoted ^= line[end++] == '"';
    if (quoted) fail(source, 1, start + 1, "expected a closing quote");
    std::string name(unquote(trim(line.substr(start, end - start))));
    for (std::size_t i = 0; (i = name.find("\"\"", i)) != std::string::npos; ++i) name.erase(i, 1);
    if (name.empty())
      fail(source, 1, start + 1, fmt::format("expected a name for channel {}, found none", names.size() + 1));
    if (std::find(names.begin(), names.end(), name) != names.end())
      fail(source, 1, start + 1, fmt::format("expected each name once, found \"{}\" again", excerpt(name)));
    double ignored;
    numbers += parse_number(name, ignored);
    names.push_back(std::move(name));
    start = end + 1;
  }
  if (numbers == names.size()) fail(source, 1, 1, "expected a header line of names, found numbers");
  if (names.size() == 1 && names[0].find_first_of(";\t") != std::string::npos)
    fail(source, 1, 1, "expected names separated by commas, found semicolons or tabs");
  return names;
}

/// Appends the cells of one line; `number` counts lines from 1.
void parse_row(std::string_view line, std::size_t number, const std::vector<std::string>& names,
               const std::string& source, std::vector<double>& values) {
  std::size_t start = 0;
  for (std::size_t k = 0;; ++k) {
    const std::size_t end = std::min(line.find(',', start), line.size());
    if (k == names.size())
      fail(source, number, start + 1,
           fmt::format("expected {} cells, found {}", names.size(), 1 + std::count(line.begin(), line.end(), ',')));
    const std::string_view cell = trim(unquote(trim(line.substr(start, end - start))));
    double value = 0;
    if (!parse_number(cell, value))
      fail(source, number, start + 1,
           fmt::format("expected a number for \"{}\", found {}", names[k],
                       cell.empty() ? "an empty cell" : fmt::format("\"{}\"", excerpt(cell))));
    if (!std::isfinite(value))
      fail(source, number, start + 1,
           fmt::format("expected a finite number for \"{}\", found {}", names[k], excerpt(cell)));
    values.push_back(value);
    if (end == line.size()) {
      if (k + 1 < names.size())
        fail(source, number, end + 1, fmt::format("expected {} cells, found {}", names.size(), k + 1));
      return;
    }
    start = end + 1;
  }
}

bool needs_quotes(const std::string& name) {
  return name.find_first_of(",\"") != std::string::npos || trim(name).size() != name.size();
}

}  // namespace

Table parse_csv(const std::string& text, const std::string& source) {
  std::size_t place = text.starts_with("\xef\xbb\xbf") ? 3 : 0;
  const std::size_t last = text.find_last_not_of(" \t\r\n");
  if (last == std::string::npos || last < place)
    throw UserError(source + ": expected a line of names, found an empty file");
  Table table;
  table.names = parse_header(next_line(text, place), source);
  std::vector<double> values;
  values.reserve(text.size() / 8);
  for (std::size_t number = 2; place <= last; ++number) {
    const std::string_view line = next_line(text, place);
    if (trim(line).empty()) fail(source, number, 1, "expected a sample, found a blank line");
    parse_row(line, number, table.names, source, values);
  }
  if (values.empty()) fail(source, 2, 1, "expected a sample, found the end of the file");
  const auto channels = static_cast<Index>(table.names.size());
  table.columns = Eigen::Map<const Matrix>(values.data(), channels, static_cast<Index>(values.size()) / channels);
  return table;
}

Table read_csv(const std::filesystem::path& file) {
  const std::string source = file.string();
  return parse_csv(is_gzip_name(file) ? unpack_gzip(read_file(file), source) : read_file(file), source);
}

void write_csv(const std::filesystem::path& file, const Table& table) {
  fmt::memory_buffer out;
  const auto end = std::back_inserter(out);
  for (std::size_t i = 0; i < table.names.size(); ++i) {
    std::string name = table.names[i];
    if (needs_quotes(name)) {
      for (std::size_t k = 0; (k = name.find('"', k)) != std::string::npos; k += 2) name.insert(k, 1, '"');
      name = fmt::format("\"{}\"", name);
    }
    fmt::format_to(end, "{}{}", i ? "," : "", name);
  }
  out.push_back('\n');
  for (Index j = 0; j < table.columns.cols(); ++j) {
    for (Index i = 0; i < table.columns.rows(); ++i) {
      if (i > 0) out.push_back(',');
      fmt::format_to(end, "{}", table.columns(i, j));
    }
    out.push_back('\n');
  }
  const std::string text = fmt::to_string(out);
  write_file(file, is_gzip_name(file) ? pack_gzip(text) : text);
}

}  // namespace wheelhop
