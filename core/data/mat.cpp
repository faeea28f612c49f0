#include "core/data/mat.hpp"

#include <fmt/format.h>
#include <matio.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <memory>
#include <set>
#include <system_error>

#include "core/base/files.hpp"
#include "core/base/json.hpp"
#include "core/base/status.hpp"
#include "core/data/gzip.hpp"

namespace wheelhop {
namespace fs = std::filesystem;
namespace {

struct CloseFile {
  void operator()(mat_t* file) const { Mat_Close(file); }
};
struct FreeVariable {
  void operator()(matvar_t* variable) const { Mat_VarFree(variable); }
};
using File = std::unique_ptr<mat_t, CloseFile>;
using Variable = std::unique_ptr<matvar_t, FreeVariable>;

/// matio would print its complaints; ours go into the exception.
void silence() {
  Mat_LogInitFunc("wheelhop", [](int, char*) {});
}

[[noreturn]] void fail(const fs::path& file, const std::string& name, const std::string& what) {
  throw UserError(fmt::format("{}: variable \"{}\": {}", file.string(), name, what));
}

template <class Number>
void copy(const void* data, Vector& out) {
  out = Eigen::Map<const Eigen::Matrix<Number, Eigen::Dynamic, 1>>(static_cast<const Number*>(data), out.size())
            .template cast<double>();
}

Vector values_of(const matvar_t& variable, const fs::path& file, const std::string& name) {
  if (variable.isComplex) fail(file, name, "expected real numbers, found complex ones");
  std::size_t count = 1, long_sides = 0;
  for (int i = 0; i < variable.rank; ++i) {
    count *= variable.dims[i];
    long_sides += variable.dims[i] > 1;
  }
  if (count == 0) fail(file, name, "expected a vector, found an empty array");
  if (long_sides > 1) fail(file, name, "expected a vector, found a matrix");
  Vector result(static_cast<Index>(count));
  if (variable.data == nullptr || variable.data_size <= 0 ||
      variable.nbytes < count * static_cast<std::size_t>(variable.data_size))
    fail(file, name, "damaged: its values cannot be read");
  switch (variable.class_type) {
    case MAT_C_DOUBLE: copy<double>(variable.data, result); break;
    case MAT_C_SINGLE: copy<float>(variable.data, result); break;
    case MAT_C_INT8: copy<mat_int8_t>(variable.data, result); break;
    case MAT_C_UINT8: copy<mat_uint8_t>(variable.data, result); break;
    case MAT_C_INT16: copy<mat_int16_t>(variable.data, result); break;
    case MAT_C_UINT16: copy<mat_uint16_t>(variable.data, result); break;
    case MAT_C_INT32: copy<mat_int32_t>(variable.data, result); break;
    case MAT_C_UINT32: copy<mat_uint32_t>(variable.data, result); break;
    case MAT_C_INT64: copy<mat_int64_t>(variable.data, result); break;
    case MAT_C_UINT64: copy<mat_uint64_t>(variable.data, result); break;
    default: fail(file, name, "expected a vector of numbers, found another kind of value");
  }
  for (Index k = 0; k < result.size(); ++k)
    if (!std::isfinite(result(k)))
      fail(file, name, fmt::format("expected finite numbers, found {} at sample {}", result(k), k));
  return result;
}

/// matio reads past the end of a shortened file and reports zeros; so the elements of the file (a tag of two 32-bit
/// words, kind and size, then content) are walked first, and packed ones are checked.
void check_elements(const std::string& content, const fs::path& file) {
  constexpr std::size_t header = 128;
  const auto refuse = [&](const char* what) { throw UserError(fmt::format("{}: {}", file.string(), what)); };
  const bool reversed = content.compare(126, 2, "MI") == 0;
  const auto word = [&](std::size_t place) {
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < 4; ++i)
      value |= static_cast<std::uint32_t>(static_cast<unsigned char>(content[place + (reversed ? 3 - i : i)]))
               << (8 * i);
    return value;
  };
  for (std::size_t place = header; place < content.size();) {
    if (content.size() - place < 8) refuse("truncated: it ends inside the tag of a variable");
    const std::uint32_t kind = word(place), size = word(place + 4);
    place += 8;
    if (size > content.size() - place) refuse("truncated: it ends inside a variable");
    constexpr std::uint32_t packed = 15;
    if (kind == packed && !is_intact_zlib(std::string_view(content).substr(place, size)))
      refuse("damaged: a packed variable does not unpack");
    place += size;
  }
}

bool is_matlab_name(const std::string& name) {
  return !name.empty() && name.size() <= 63 && std::isalpha(static_cast<unsigned char>(name[0])) &&
         std::all_of(name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) || c == '_'; });
}

/// Writes the variables into a new file; 0 or errno.
int write_variables(const fs::path& file, const Table& table) {
  errno = 0;
  const auto reason = [] { return errno != 0 ? errno : EIO; };
  // The default header would carry the time of day.
  File out(Mat_CreateVer(file.c_str(), "MATLAB 5.0 MAT-file, written by wheelhop", MAT_FT_MAT5));
  if (!out) return reason();
  for (std::size_t i = 0; i < table.names.size(); ++i) {
    Vector values = table.columns.row(static_cast<Index>(i)).transpose();
    std::size_t dims[2] = {static_cast<std::size_t>(values.size()), 1};
    const Variable variable(
        Mat_VarCreate(table.names[i].c_str(), MAT_C_DOUBLE, MAT_T_DOUBLE, 2, dims, values.data(), 0));
    if (!variable || Mat_VarWrite(out.get(), variable.get(), MAT_COMPRESSION_NONE) != 0) return reason();
  }
  return 0;
}

}  // namespace

Table read_mat(const fs::path& file, const std::vector<std::string>& wanted) {
  silence();
  const std::string content = read_file(file);
  const auto refuse = [&](const char* found) {
    throw UserError(
        fmt::format("{}: expected a MATLAB file of version 5 (save -v6 or -v7), found {}", file.string(), found));
  };
  if (content.empty()) refuse("an empty file");
  // A header of version 5 says so at byte 124, in the byte order that "IM" or "MI" behind it shows.
  if (content.size() < 128 || !content.starts_with("MATLAB")) refuse("other content");
  const std::string version = content.substr(124, 4);
  if (version == std::string("\0\2IM", 4) || version == std::string("\2\0MI", 4)) refuse("version 7.3");
  if (version != std::string("\0\1IM", 4) && version != std::string("\1\0MI", 4)) refuse("other content");
  check_elements(content, file);
  const File in(Mat_Open(file.c_str(), MAT_ACC_RDONLY));
  if (!in) refuse("other content");
  std::size_t count = 0;
  char* const* directory = Mat_GetDir(in.get(), &count);
  std::vector<std::string> present;
  for (std::size_t i = 0; directory != nullptr && i < count; ++i)
    if (directory[i] != nullptr) present.emplace_back(directory[i]);
  if (present.empty()) throw UserError(fmt::format("{}: expected variables, found none", file.string()));
  Table table;
  table.names = wanted.empty() ? present : wanted;
  for (std::size_t i = 0; i < table.names.size(); ++i) {
    const std::string& name = table.names[i];
    if (std::find(present.begin(), present.end(), name) == present.end())
      fail(file, name, fmt::format("not there; known names: {}", join_names(present)));
    const Variable variable(Mat_VarRead(in.get(), name.c_str()));
    if (!variable) fail(file, name, "damaged: it cannot be read");
    const Vector values = values_of(*variable, file, name);
    if (i == 0) table.columns.resize(static_cast<Index>(table.names.size()), values.size());
    if (values.size() != table.columns.cols())
      fail(file, name,
           fmt::format("expected {} values as in \"{}\", found {}", table.columns.cols(), table.names[0],
                       values.size()));
    table.columns.row(static_cast<Index>(i)) = values.transpose();
  }
  return table;
}

void write_mat(const fs::path& file, const Table& table) {
  silence();
  std::set<std::string> seen;
  for (const std::string& name : table.names) {
    if (!is_matlab_name(name)) fail(file, name, "expected a name MATLAB accepts (letters, digits, underscores)");
    if (!seen.insert(name).second) fail(file, name, "appears twice");
  }
  // matio writes to a path only: it fills a file beside the target, whose content then goes the way of every file.
  const fs::path part = temporary_beside(file);
  std::error_code ignored;
  try {
    if (const int error = write_variables(part, table))
      throw MachineError(fmt::format("{}: cannot write: {}", file.string(), std::generic_category().message(error)));
    const std::string content = read_file(part);
    check_elements(content, file);  // a disk that fills up while matio closes its file goes unreported
    write_file(file, content);
  } catch (...) {
    fs::remove(part, ignored);
    throw;
  }
  fs::remove(part, ignored);
}

}  // namespace wheelhop
