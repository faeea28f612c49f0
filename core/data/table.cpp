#include "core/data/table.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <new>

#include "core/base/status.hpp"
#include "core/data/csv.hpp"
#include "core/data/mat.hpp"

namespace wheelhop {
namespace {

enum class Format { csv, mat };

Format format_of(const std::filesystem::path& file) {
  std::string name = file.filename().string();
  for (char& c : name) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (name.ends_with(".csv") || name.ends_with(".csv.gz")) return Format::csv;
  if (name.ends_with(".mat")) return Format::mat;
  throw UserError(fmt::format("{}: expected a file name ending in .csv, .csv.gz or .mat", file.string()));
}

void check_finite(const std::filesystem::path& file, const Table& table) {
  for (Index j = 0; j < table.columns.cols(); ++j)
    for (Index i = 0; i < table.columns.rows(); ++i)
      if (!std::isfinite(table.columns(i, j)))
        throw UserError(fmt::format("{}: cannot write: channel \"{}\" is not finite at sample {}", file.string(),
                                    table.names[static_cast<std::size_t>(i)], j));
}

}  // namespace

Index Table::find(const std::string& name) const {
  const auto place = std::find(names.begin(), names.end(), name);
  return place == names.end() ? -1 : static_cast<Index>(place - names.begin());
}

Table read_table(const std::filesystem::path& file, const std::vector<std::string>& wanted) {
  try {
    return format_of(file) == Format::csv ? read_csv(file) : read_mat(file, wanted);
  } catch (const std::bad_alloc&) {
    throw MachineError(fmt::format("{}: not enough memory for its table", file.string()));
  }
}

void require_table_name(const std::filesystem::path& file) { format_of(file); }

void write_table(const std::filesystem::path& file, const Table& table) {
  const Format format = format_of(file);
  check_finite(file, table);
  if (format == Format::csv)
    write_csv(file, table);
  else
    write_mat(file, table);
}

}  // namespace wheelhop
