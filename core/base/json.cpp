#include "core/base/json.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <new>
#include <numeric>

#include "core/base/files.hpp"
#include "core/base/status.hpp"

namespace wheelhop {

struct JsonCursor::Document {
  std::string source;
  std::filesystem::path directory;
  Json root;
  std::map<const Json*, std::vector<std::string>> asked;  ///< names asked for, by object, in order of asking

  void ask(const Json* object, std::string_view key) {
    std::vector<std::string>& names = asked[object];
    if (std::find(names.begin(), names.end(), key) == names.end()) names.emplace_back(key);
  }
};

namespace {

std::string lower(std::string_view text) {
  std::string result(text);
  for (char& c : result) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return result;
}

/// Edit distance with insertion, deletion, substitution and transposition of neighbours.
std::size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> before_last, last(b.size() + 1), row(b.size() + 1);
  std::iota(last.begin(), last.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (a[i - 1] != b[j - 1])});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        row[j] = std::min(row[j], before_last[j - 2] + 1);
    }
    before_last = last;
    last = row;
  }
  return last.back();
}

/// True for `mass` and `mass_kg`.
bool differ_by_suffix(const std::string& a, const std::string& b) {
  const std::string& shorter = a.size() < b.size() ? a : b;
  const std::string& longer = a.size() < b.size() ? b : a;
  return !shorter.empty() && longer.size() > shorter.size() && longer.starts_with(shorter) &&
         longer[shorter.size()] == '_';
}

std::string member_path(const std::string& path, std::string_view key) {
  const bool plain = !key.empty() && std::all_of(key.begin(), key.end(), [](unsigned char c) {
    return std::isalnum(c) || c == '_' || c == '-';
  });
  return plain ? fmt::format("{}.{}", path, key) : fmt::format("{}[\"{}\"]", path, key);
}

std::string describe(const Json& value) {
  if (value.is_object()) return "an object";
  if (value.is_array()) return fmt::format("an array of {}", value.size());
  std::string text = value.dump(-1, ' ', false, Json::error_handler_t::replace);
  if (value.is_number_float() && !std::isfinite(value.get<double>())) text = fmt::format("{}", value.get<double>());
  if (text.size() > 60) text = text.substr(0, 57) + "...";
  return text;
}

std::vector<std::string> keys_of(const Json& object) {
  std::vector<std::string> result;
  for (const auto& member : object.items()) result.push_back(member.key());
  return result;
}

std::string hint(std::string_view word, const std::vector<std::string>& known) {
  const std::string nearest = nearest_name(word, known);
  return nearest.empty() ? "" : fmt::format("; did you mean \"{}\"?", nearest);
}

}  // namespace

std::string to_string(Range range) {
  const bool below = std::isfinite(range.low);
  const bool above = std::isfinite(range.high);
  if (below && above) return fmt::format("number in [{}, {}]", range.low, range.high);
  if (below) return fmt::format("number >= {}", range.low);
  if (above) return fmt::format("number <= {}", range.high);
  return "number";
}

std::string join_names(const std::vector<std::string>& names) {
  std::string result;
  for (const std::string& name : names) result += (result.empty() ? "" : ", ") + name;
  return result;
}

std::string nearest_name(std::string_view word, const std::vector<std::string>& known) {
  const std::string wanted = lower(word);
  std::string best;
  std::size_t best_distance = std::numeric_limits<std::size_t>::max();
  for (const std::string& name : known) {
    const std::string candidate = lower(name);
    const std::size_t distance = differ_by_suffix(wanted, candidate) ? 1 : edit_distance(wanted, candidate);
    const std::size_t allowed = std::max<std::size_t>(1, std::max(wanted.size(), candidate.size()) / 3);
    if (distance <= allowed && distance < std::max(wanted.size(), candidate.size()) && distance < best_distance) {
      best = name;
      best_distance = distance;
    }
  }
  return best;
}

JsonCursor::JsonCursor(std::shared_ptr<Document> document, const Json* value, std::string path)
    : document_(std::move(document)), value_(value), path_(std::move(path)) {}

JsonCursor JsonCursor::load(const std::filesystem::path& file) {
  try {
    return from(parse_json(read_file(file), file.string()), file.string(), file.parent_path());
  } catch (const std::bad_alloc&) {
    throw MachineError(fmt::format("{}: not enough memory for its values", file.string()));
  }
}

JsonCursor JsonCursor::from(Json value, std::string source, std::filesystem::path directory) {
  auto document = std::make_shared<Document>();
  document->source = std::move(source);
  document->directory = std::move(directory);
  document->root = std::move(value);
  const Json* root = &document->root;
  return JsonCursor(std::move(document), root, "$");
}

std::string JsonCursor::where() const { return document_->source + ": " + path_; }
const std::filesystem::path& JsonCursor::directory() const { return document_->directory; }
const Json& JsonCursor::raw() const { return *value_; }
bool JsonCursor::is_object() const { return value_->is_object(); }
bool JsonCursor::is_array() const { return value_->is_array(); }
bool JsonCursor::is_string() const { return value_->is_string(); }
bool JsonCursor::is_number() const { return value_->is_number(); }

void JsonCursor::fail(const std::string& expected) const {
  throw UserError(fmt::format("{}: expected {}, found {}", where(), expected, describe(*value_)));
}

std::optional<JsonCursor> JsonCursor::find(std::string_view key) const {
  if (!value_->is_object()) fail("an object");
  document_->ask(value_, key);
  const auto member = value_->find(std::string(key));
  if (member == value_->end()) return std::nullopt;
  return JsonCursor(document_, &*member, member_path(path_, key));
}

bool JsonCursor::has(std::string_view key) const { return find(key).has_value(); }

JsonCursor JsonCursor::at(std::string_view key) const {
  if (auto member = find(key)) return *member;
  const std::vector<std::string> present = keys_of(*value_);
  const std::string nearest = nearest_name(key, present);
  throw UserError(fmt::format("{}: expected the key \"{}\", found {}{}", where(), key,
                              present.empty() ? "an empty object" : "only: " + join_names(present),
                              nearest.empty() ? "" : fmt::format("; did you mean \"{}\" by \"{}\"?", key, nearest)));
}

std::vector<JsonCursor> JsonCursor::items() const {
  if (!value_->is_array()) fail("an array");
  std::vector<JsonCursor> result;
  result.reserve(value_->size());
  for (std::size_t i = 0; i < value_->size(); ++i)
    result.push_back(JsonCursor(document_, &(*value_)[i], fmt::format("{}[{}]", path_, i)));
  return result;
}

double JsonCursor::number(Range range) const {
  const std::string expected = "a " + to_string(range);
  if (!value_->is_number()) fail(expected);
  const double result = value_->get<double>();
  if (!std::isfinite(result)) fail("a finite number");
  if (!(result >= range.low && result <= range.high)) fail(expected);
  return result;
}

Index JsonCursor::integer(Index low, Index high) const {
  const bool bounded_below = low > std::numeric_limits<Index>::min();
  const bool bounded_above = high < std::numeric_limits<Index>::max();
  std::string expected = "a whole number";
  if (bounded_below && bounded_above)
    expected += fmt::format(" in [{}, {}]", low, high);
  else if (bounded_below)
    expected += fmt::format(" >= {}", low);
  else if (bounded_above)
    expected += fmt::format(" <= {}", high);
  Index result = 0;
  if (value_->is_number_unsigned()) {
    const auto wide = value_->get<std::uint64_t>();
    if (wide > static_cast<std::uint64_t>(std::numeric_limits<Index>::max())) fail(expected);
    result = static_cast<Index>(wide);
  } else if (value_->is_number_integer()) {
    result = value_->get<std::int64_t>();
  } else if (value_->is_number_float()) {
    // Beyond 2^53 a double no longer says which whole number is meant.
    const double real = value_->get<double>();
    if (!(std::abs(real) <= 0x1p53) || real != std::floor(real)) fail(expected);
    result = static_cast<Index>(real);
  } else {
    fail(expected);
  }
  if (result < low || result > high) fail(expected);
  return result;
}

bool JsonCursor::boolean() const {
  if (!value_->is_boolean()) fail("true or false");
  return value_->get<bool>();
}

std::string JsonCursor::string() const {
  if (!value_->is_string()) fail("a string");
  std::string result = value_->get<std::string>();
  // Names of files and channels go through functions that end at the first zero.
  if (result.find('\0') != std::string::npos) fail("a string without the character NUL");
  return result;
}

std::vector<double> JsonCursor::numbers() const {
  if (!value_->is_array()) fail("an array of numbers");
  std::vector<double> result;
  result.reserve(value_->size());
  for (const JsonCursor& item : items()) result.push_back(item.number());
  return result;
}

std::string JsonCursor::one_of(const std::vector<std::string>& known) const {
  if (!value_->is_string()) fail("one of: " + join_names(known));
  const std::string result = value_->get<std::string>();
  if (std::find(known.begin(), known.end(), result) != known.end()) return result;
  throw UserError(fmt::format("{}: expected a known name, found {}; known names: {}{}", where(), describe(*value_),
                              join_names(known), hint(result, known)));
}

double JsonCursor::number(std::string_view key, double fallback, Range range) const {
  const auto member = find(key);
  return member ? member->number(range) : fallback;
}

Index JsonCursor::integer(std::string_view key, Index fallback, Index low, Index high) const {
  const auto member = find(key);
  return member ? member->integer(low, high) : fallback;
}

bool JsonCursor::boolean(std::string_view key, bool fallback) const {
  const auto member = find(key);
  return member ? member->boolean() : fallback;
}

std::string JsonCursor::string(std::string_view key, const std::string& fallback) const {
  const auto member = find(key);
  return member ? member->string() : fallback;
}

void JsonCursor::done() const {
  if (!value_->is_object()) fail("an object");
  const std::vector<std::string>& known = document_->asked[value_];
  for (const std::string& key : keys_of(*value_)) {
    if (std::find(known.begin(), known.end(), key) != known.end()) continue;
    std::vector<std::string> absent;  // a known name that stands there already cannot be the one that was meant
    for (const std::string& name : known)
      if (!value_->contains(name)) absent.push_back(name);
    throw UserError(fmt::format("{}: {}: expected a known name, found \"{}\"; known names: {}{}", document_->source,
                                member_path(path_, key), key, known.empty() ? "none" : join_names(known),
                                hint(key, absent)));
  }
}

Json to_json(ConstMatrixRef M) {
  Json rows = Json::array();
  for (Index i = 0; i < M.rows(); ++i) {
    Json row = Json::array();
    for (Index j = 0; j < M.cols(); ++j) row.push_back(std::isfinite(M(i, j)) ? Json(M(i, j)) : Json(nullptr));
    rows.push_back(std::move(row));
  }
  return rows;
}

Matrix matrix_from_json(const JsonCursor& cursor) {
  const std::vector<JsonCursor> rows = cursor.items();
  Matrix result;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const std::vector<double> row = rows[i].numbers();
    const auto columns = static_cast<Index>(row.size());
    if (i == 0) result.resize(static_cast<Index>(rows.size()), columns);
    if (columns != result.cols()) rows[i].fail(fmt::format("a row of {} numbers like the first", result.cols()));
    result.row(static_cast<Index>(i)) = Eigen::Map<const Vector>(row.data(), columns).transpose();
  }
  return result;
}

}  // namespace wheelhop
