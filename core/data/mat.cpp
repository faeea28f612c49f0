#include "core/data/mat.hpp"

#include <fmt/format.h>
#include <matio.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <string_view>
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

/// Files are written by matio, and read by the code below, which believes no size that a file declares. matio would
/// print its complaints; ours go into the exception.
void silence() {
  Mat_LogInitFunc("wheelhop", [](int, char*) {});
}

[[noreturn]] void fail(const fs::path& file, const std::string& name, const std::string& what) {
  throw UserError(fmt::format("{}: variable \"{}\": {}", file.string(), name, what));
}

/// Kinds of elements of a file, by the numbers of the format.
enum ElementKind : std::uint32_t {
  kInt8 = 1,
  kUint8,
  kInt16,
  kUint16,
  kInt32,
  kUint32,
  kSingle,
  kDouble = 9,
  kInt64 = 12,
  kUint64 = 13,
  kMatrix = 14,
  kPacked = 15
};

/// Classes of variables: numbers are those from kFirstNumber on.
constexpr std::uint32_t kFirstNumber = 6, kLastNumber = 15;

/// Bytes of a number, 0 of what is none.
std::size_t width_of(std::uint32_t kind) {
  switch (kind) {
    case kInt8:
    case kUint8: return 1;
    case kInt16:
    case kUint16: return 2;
    case kInt32:
    case kUint32:
    case kSingle: return 4;
    case kDouble:
    case kInt64:
    case kUint64: return 8;
    default: return 0;
  }
}

/// What a part of a file says of itself that it does not hold; the text says what.
struct Damage {
  std::string what;
};

/// An element: a tag of two 32-bit words, kind and size, then the content, filled up to eight bytes. Four bytes or less
/// stand in the tag, whose first word then holds size and kind.
struct MatElement {
  std::uint32_t kind = 0;
  std::string_view content;
};

/// Numbers from bytes of either order.
class MatBytes {
 public:
  explicit MatBytes(bool reversed) : reversed_(reversed) {}

  template <class Number>
  Number number(const char* place) const {
    std::array<char, sizeof(Number)> own;
    std::copy(place, place + sizeof(Number), own.begin());
    if (reversed_) std::reverse(own.begin(), own.end());
    return std::bit_cast<Number>(own);
  }

  /// The element at `place`, which is moved behind it. Throws Damage where it reaches beyond the bytes.
  MatElement element(std::string_view bytes, std::size_t& place) const {
    if (place > bytes.size() || bytes.size() - place < 8) throw Damage{"truncated: it ends inside a tag"};
    const auto first = number<std::uint32_t>(bytes.data() + place);
    if (const std::uint32_t size = first >> 16; size != 0) {
      if (size > 4) throw Damage{"damaged: a tag of four bytes declares more"};
      place += 8;
      return {first & 0xffff, bytes.substr(place - 4, size)};
    }
    const auto size = number<std::uint32_t>(bytes.data() + place + 4);
    if (size > bytes.size() - place - 8)
      throw Damage{fmt::format("truncated: it declares {} bytes and holds {}", size, bytes.size() - place - 8)};
    const MatElement found{first, bytes.substr(place + 8, size)};
    place += 8 + size;
    if (first != kPacked) place += (8 - size % 8) % 8;
    return found;
  }

  template <class Number>
  void copy(std::string_view from, Vector& out) const {
    for (Index k = 0; k < out.size(); ++k)
      out(k) = static_cast<double>(number<Number>(from.data() + static_cast<std::size_t>(k) * sizeof(Number)));
  }

  Vector numbers(const MatElement& element, Index count) const {
    Vector out(count);
    switch (element.kind) {
      case kInt8: copy<std::int8_t>(element.content, out); break;
      case kUint8: copy<std::uint8_t>(element.content, out); break;
      case kInt16: copy<std::int16_t>(element.content, out); break;
      case kUint16: copy<std::uint16_t>(element.content, out); break;
      case kInt32: copy<std::int32_t>(element.content, out); break;
      case kUint32: copy<std::uint32_t>(element.content, out); break;
      case kSingle: copy<float>(element.content, out); break;
      case kInt64: copy<std::int64_t>(element.content, out); break;
      case kUint64: copy<std::uint64_t>(element.content, out); break;
      default: copy<double>(element.content, out);
    }
    return out;
  }

 private:
  bool reversed_;
};

/// What stands before the values of a variable.
struct MatHeader {
  std::uint32_t kind = 0;  ///< its class
  bool complex = false;
  std::vector<std::int32_t> sides;
  std::string name;
  std::size_t values_at = 0;  ///< where its values begin

  bool is_number() const { return kind >= kFirstNumber && kind <= kLastNumber; }
};

/// @param bytes content of a variable, or as much of its beginning as is there
MatHeader read_mat_header(std::string_view bytes, const MatBytes& read) {
  MatHeader header;
  std::size_t& place = header.values_at;
  const MatElement flags = read.element(bytes, place);
  if (flags.kind != kUint32 || flags.content.size() != 8) throw Damage{"damaged: a variable without its flags"};
  const auto word = read.number<std::uint32_t>(flags.content.data());
  header.kind = word & 0xff;
  header.complex = (word & 0x800) != 0;
  try {
    const MatElement sides = read.element(bytes, place);
    if (sides.kind != kInt32 || sides.content.size() < 8 || sides.content.size() % 4 != 0)
      throw Damage{"damaged: a variable without its sides"};
    for (std::size_t at = 0; at < sides.content.size(); at += 4)
      header.sides.push_back(read.number<std::int32_t>(sides.content.data() + at));
    const MatElement name = read.element(bytes, place);
    if (name.kind != kInt8) throw Damage{"damaged: a variable without its name"};
    header.name = name.content;
  } catch (const Damage&) {
    if (header.is_number()) throw;  // objects and the like go by rules of their own
  }
  return header;
}

/// Number of values of a variable that is a vector.
Index length_of(const MatHeader& header, const fs::path& file) {
  const std::string& name = header.name;
  if (!header.is_number()) fail(file, name, "expected a vector of numbers, found another kind of value");
  if (header.complex) fail(file, name, "expected real numbers, found complex ones");
  Index length = 1;
  int long_sides = 0;
  for (const std::int32_t side : header.sides) {
    if (side < 0) fail(file, name, fmt::format("damaged: a side of {}", side));
    if (side != 1) length = side;
    if (side == 0) fail(file, name, "expected a vector, found an empty array");
    long_sides += side > 1;
  }
  if (long_sides > 1) fail(file, name, "expected a vector, found a matrix");
  return length;
}

/// The values of a vector, all of which stand in the bytes. @param bytes content of the variable
Vector mat_values(std::string_view bytes, const MatBytes& read, const fs::path& file) {
  MatHeader header = read_mat_header(bytes, read);
  const Index length = length_of(header, file);
  MatElement values;
  try {
    values = read.element(bytes, header.values_at);
  } catch (const Damage& damage) {
    fail(file, header.name, damage.what);
  }
  const std::size_t width = width_of(values.kind);
  if (width == 0) fail(file, header.name, "damaged: its values are no numbers");
  if (values.content.size() != static_cast<std::size_t>(length) * width)
    fail(file, header.name,
         fmt::format("damaged: it declares {} values and holds {} bytes of {} each", length, values.content.size(),
                     width));
  return read.numbers(values, length);
}

/// A variable where it stands in a file.
struct MatVariable {
  std::string name;
  MatElement element;
};

/// Bytes of a packed variable that hold everything before its values.
constexpr std::size_t kHeaderBytes = 4096;

/// The variables of a file that have a name, in its order. UserError naming the file where an element, or what a packed
/// one unpacks to, is not whole.
std::vector<MatVariable> mat_variables(const std::string& content, const MatBytes& read, const fs::path& file) {
  constexpr std::size_t header = 128;
  std::vector<MatVariable> found;
  const std::string_view bytes = content;
  try {
    for (std::size_t place = header; place < bytes.size();) {
      const MatElement element = read.element(bytes, place);
      std::string_view inside = element.content;
      std::string begin;
      if (element.kind == kPacked) {
        if (!is_intact_zlib(inside)) throw Damage{"damaged: a packed variable does not unpack"};
        begin = unpack_zlib(inside, kHeaderBytes).value_or("");
        if (begin.size() < 8) throw Damage{"damaged: a packed variable holds nothing"};
        inside = std::string_view(begin).substr(8);
      } else if (element.kind != kMatrix) {
        continue;
      }
      if (inside.empty()) continue;
      const std::string name = read_mat_header(inside, read).name;
      if (!name.empty()) found.push_back({name, element});
    }
  } catch (const Damage& damage) {
    throw UserError(fmt::format("{}: {}", file.string(), damage.what));
  }
  return found;
}

Vector read_mat_variable(const MatVariable& variable, const MatBytes& read, const fs::path& file) {
  const std::string_view content = variable.element.content;
  if (variable.element.kind != kPacked) return mat_values(content, read, file);
  const std::string begin = unpack_zlib(content, 8).value_or(std::string(8, '\0'));
  const std::size_t declared = read.number<std::uint32_t>(begin.data() + 4);
  if (read.number<std::uint32_t>(begin.data()) != kMatrix)
    fail(file, variable.name, "damaged: what it unpacks to is no variable");
  const double most = read_limits().unpacked_from(content.size());
  if (static_cast<double>(declared) > most)
    fail(file, variable.name,
         fmt::format("expected at most {:.0f} bytes in a packed variable of {}, found {}; {}", most, content.size(),
                     declared, how_to_lift));
  const std::string unpacked = unpack_zlib(content, declared + 8).value_or("");
  if (unpacked.size() < declared + 8) {
    length_of(read_mat_header(std::string_view(unpacked).substr(8), read), file);  // texts of matio declare too much
    fail(file, variable.name,
         fmt::format("damaged: it declares {} bytes and unpacks to {}", declared + 8, unpacked.size()));
  }
  return mat_values(std::string_view(unpacked).substr(8), read, file);
}

/// What the file says of its version and the order of its bytes. UserError if it is no MATLAB file of version 5.
MatBytes check_mat_header(const std::string& content, const fs::path& file) {
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
  const bool file_is_big = version.ends_with("MI");
  return MatBytes(file_is_big != (std::endian::native == std::endian::big));
}

/// A disk that fills up while matio closes its file goes unreported: what was written is read again.
bool holds_variables(const std::string& content, std::size_t count) {
  try {
    return mat_variables(content, check_mat_header(content, ""), "").size() == count;
  } catch (const UserError&) {
    return false;
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

Table read_mat(const fs::path& file, const std::vector<std::string>& wanted, bool finite) {
  const std::string content = read_file(file);
  const MatBytes read = check_mat_header(content, file);
  const std::vector<MatVariable> variables = mat_variables(content, read, file);
  if (variables.empty()) throw UserError(fmt::format("{}: expected variables, found none", file.string()));
  std::vector<std::string> present;
  for (const MatVariable& variable : variables) present.push_back(variable.name);
  Table table;
  table.names = wanted.empty() ? present : wanted;
  for (std::size_t i = 0; i < table.names.size(); ++i) {
    const std::string& name = table.names[i];
    const auto place = std::find(present.begin(), present.end(), name);
    if (place == present.end()) fail(file, name, fmt::format("not there; known names: {}", join_names(present)));
    const Vector values = read_mat_variable(variables[static_cast<std::size_t>(place - present.begin())], read, file);
    for (Index k = 0; finite && k < values.size(); ++k)
      if (!std::isfinite(values(k)))
        fail(file, name, fmt::format("expected finite numbers, found {} at sample {}", values(k), k));
    if (i == 0) table.columns.resize(static_cast<Index>(table.names.size()), values.size());
    if (values.size() != table.columns.cols())
      fail(file, name,
           fmt::format("expected {} values as in \"{}\", found {}", table.columns.cols(), table.names[0],
                       values.size()));
    table.columns.row(static_cast<Index>(i)) = values.transpose();
  }
  return table;
}

Table read_mat_vectors(const fs::path& file) {
  const std::string content = read_file(file);
  const MatBytes read = check_mat_header(content, file);
  std::vector<std::pair<std::string, Vector>> vectors;
  std::map<Index, Index> values;  // by length
  for (const MatVariable& variable : mat_variables(content, read, file)) try {
      vectors.emplace_back(variable.name, read_mat_variable(variable, read, file));
      values[vectors.back().second.size()] += vectors.back().second.size();
    } catch (const MachineError&) {
      throw;
    } catch (const UserError&) {
      continue;  // texts, matrices, structures
    }
  if (vectors.empty()) throw UserError(fmt::format("{}: expected vectors of numbers, found none", file.string()));
  const Index length = std::max_element(values.begin(), values.end(), [](const auto& a, const auto& b) {
                         return a.second < b.second;
                       })->first;
  std::erase_if(vectors, [&](const auto& vector) { return vector.second.size() != length; });
  Table table{{}, Matrix(static_cast<Index>(vectors.size()), length)};
  for (const auto& [name, own] : vectors) {
    table.columns.row(static_cast<Index>(table.names.size())) = own.transpose();
    table.names.push_back(name);
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
    if (!holds_variables(content, table.names.size()))
      throw MachineError(fmt::format("{}: cannot write: a part of it did not reach the disk", file.string()));
    write_file(file, content);
  } catch (...) {
    fs::remove(part, ignored);
    throw;
  }
  fs::remove(part, ignored);
}

}  // namespace wheelhop
