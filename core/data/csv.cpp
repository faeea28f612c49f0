#include "core/data/csv.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "core/base/files.hpp"
#include "core/base/status.hpp"
#include "core/data/gzip.hpp"
#include "core/data/text_table.hpp"

namespace wheelhop {
namespace {

bool is_gzip_name(const std::filesystem::path& file) {
  const std::string ending = file.extension().string();
  return ending == ".gz" || ending == ".GZ";
}

std::vector<std::string> parse_header(std::string_view line, const std::string& source) {
  const auto binary = std::find_if(line.begin(), line.end(),
                                   [](unsigned char c) { return (c < 32 && c != '\t' && c != '\r') || c == 127; });
  if (binary != line.end())
    fail_in_text(source, 1, static_cast<std::size_t>(binary - line.begin()) + 1,
                 "expected a line of names, found binary content");
  std::vector<std::string> names;
  std::size_t numbers = 0;
  Cells cells(line, ',');
  for (std::string_view cell; cells.next(cell);) {
    const std::size_t column = cells.start() + 1;
    if (cells.open()) fail_in_text(source, 1, column, "expected a closing quote");
    std::string name = unescape_quotes(cell);
    if (name.empty())
      fail_in_text(source, 1, column, fmt::format("expected a name for channel {}, found none", names.size() + 1));
    if (std::find(names.begin(), names.end(), name) != names.end())
      fail_in_text(source, 1, column, fmt::format("expected each name once, found \"{}\" again", excerpt(name)));
    double ignored;
    numbers += parse_number(name, ignored);
    names.push_back(std::move(name));
  }
  if (numbers == names.size()) fail_in_text(source, 1, 1, "expected a header line of names, found numbers");
  if (names.size() == 1 && names[0].find_first_of(";\t") != std::string::npos)
    fail_in_text(source, 1, 1, "expected names separated by commas, found semicolons or tabs");
  return names;
}

bool needs_quotes(const std::string& name) {
  return name.find_first_of(",\"") != std::string::npos || trim(name).size() != name.size();
}

}  // namespace

std::string read_text(const std::filesystem::path& file) {
  return is_gzip_name(file) ? unpack_gzip(read_file(file), file.string()) : read_file(file);
}

Table parse_csv(const std::string& text, const std::string& source) {
  Lines lines(text);
  std::string_view header;
  if (!lines.next(header)) throw UserError(source + ": expected a line of names, found an empty file");
  TextLayout plain;
  plain.names = parse_header(header, source);
  std::vector<WantedColumn> all;
  for (std::size_t i = 0; i < plain.names.size(); ++i) all.push_back({i, false});
  TextTable table = read_text_table(text, plain, all);
  const Index samples = table.columns.cols();
  if (samples == 0) fail_in_text(source, 2, 1, "expected a sample, found the end of the file");
  table.require_sound(0, samples, source);
  return {std::move(plain.names), std::move(table.columns)};
}

Table read_csv(const std::filesystem::path& file) { return parse_csv(read_text(file), file.string()); }

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
