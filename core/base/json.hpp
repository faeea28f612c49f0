/// \file
/// Strict reading of JSON: every value knows its file and path, every key must be read by somebody, and each mistake
/// ends in one UserError with file, JSON path, what was expected, what was found and the known names.
#pragma once

#include <filesystem>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/linalg.hpp"

namespace wheelhop {

/// Keys keep the order in which they were written, so that result files are stable and readable.
using Json = nlohmann::ordered_json;

/// Closed interval of admissible numbers.
struct Range {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
};

/// "number in [0, 1]", "number >= 0" or "number": what a range admits, in words.
std::string to_string(Range range);

/// A cursor over one JSON value of a user's file. Copies share the record of which keys were read.
///
/// Throws UserError from every read: missing key (with the nearest known name), wrong type, number out of range.
/// `done()` must be called once all keys of an object were asked for; it refuses the keys nobody read.
class JsonCursor {
 public:
  /// Parses a file. UserError if it cannot be read, is not JSON (line and column named) or repeats a key in an object.
  static JsonCursor load(const std::filesystem::path& file);
  /// A cursor over a value that is already in memory; `source` stands for the file in messages, and names of files in
  /// it are relative to `directory`.
  static JsonCursor from(Json value, std::string source, std::filesystem::path directory = {});

  bool has(std::string_view key) const;                        ///< counts as asking for the key
  JsonCursor at(std::string_view key) const;                   ///< required member
  std::optional<JsonCursor> find(std::string_view key) const;  ///< optional member
  std::vector<JsonCursor> items() const;                       ///< elements of an array

  double number(Range range = {}) const;  ///< finite number inside the range
  /// Whole number in [low, high]; 4.0 counts as 4.
  Index integer(Index low = std::numeric_limits<Index>::min(), Index high = std::numeric_limits<Index>::max()) const;
  bool boolean() const;
  std::string string() const;           ///< without the character NUL
  std::vector<double> numbers() const;  ///< array of finite numbers
  /// A string that must be one of `known`.
  std::string one_of(const std::vector<std::string>& known) const;

  double number(std::string_view key, double fallback, Range range = {}) const;
  Index integer(std::string_view key, Index fallback, Index low, Index high) const;
  bool boolean(std::string_view key, bool fallback) const;
  std::string string(std::string_view key, const std::string& fallback) const;

  bool is_object() const;
  bool is_array() const;
  bool is_string() const;
  bool is_number() const;
  const Json& raw() const;  ///< the value itself; marks nothing as read

  /// Refuses every member of this object that was never asked for, naming those that are known here.
  void done() const;
  /// Throws UserError "FILE: PATH: expected EXPECTED, found ...".
  [[noreturn]] void fail(const std::string& expected) const;
  std::string where() const;                       ///< "file.json: $.masses[0].mass_kg"
  const std::filesystem::path& directory() const;  ///< folder of the file, for paths relative to it

 private:
  struct Document;
  JsonCursor(std::shared_ptr<Document> document, const Json* value, std::string path);
  std::shared_ptr<Document> document_;
  const Json* value_ = nullptr;
  std::string path_;
};

/// Parses JSON text (RFC 8259: no comments, no NaN, no trailing comma). UserError with `source`, line and column on a
/// syntax error, a key repeated in an object, a number beyond the range of a double, or more than 200 nested levels.
Json parse_json(const std::string& text, const std::string& source);

/// "did you mean ...": the entry of `known` nearest to `word` by edit distance, empty if none is near. A name that
/// lacks or has too much of a `_suffix` (`mass` for `mass_kg`) and one that differs in case only are near.
std::string nearest_name(std::string_view word, const std::vector<std::string>& known);

/// "a, b, c" for messages.
std::string join_names(const std::vector<std::string>& names);

/// Rows as nested arrays (M(0, :) first); non-finite entries become null.
Json to_json(ConstMatrixRef M);
/// A matrix from nested arrays (row by row) of equal length.
Matrix matrix_from_json(const JsonCursor& cursor);

}  // namespace wheelhop
