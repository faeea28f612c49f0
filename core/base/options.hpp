/// \file
/// One JSON object <-> one options struct. A struct lists its fields once, in
/// `template <class V> void fields(V&& visit)`, as `visit(name, field, Range{...}, unit, meaning)`; reading, writing,
/// range check and help all come from that list. Field types: double, std::optional<double> (null: none), Index,
/// bool, std::string, std::vector<std::string>, std::pair<double, double> (an interval [low, high]).
/// A string field has a list of choices: `visit(name, field, Choices{...}, meaning)`; an empty list admits any string.
/// A list of strings has one as well, for each of its members, of which there is at least one.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/base/json.hpp"

namespace wheelhop {

struct Choices {
  std::vector<std::string> names;
};

/// What `wheelhop list` and the help print about one option.
struct OptionInfo {
  std::string name;
  Json fallback;
  std::string unit;
  std::string range;
  std::string meaning;
};

namespace detail {

/// Smallest and largest whole number inside a range; an infinite end becomes the end of Index.
Index lowest(Range range);
Index highest(Range range);

struct OptionReader {
  const JsonCursor& cursor;
  void operator()(const char* name, double& field, Range range, const char*, const char*) {
    field = cursor.number(name, field, range);
  }
  void operator()(const char* name, std::optional<double>& field, Range range, const char*, const char*) {
    if (const auto member = cursor.find(name))
      field = member->raw().is_null() ? std::nullopt : std::optional(member->number(range));
  }
  void operator()(const char* name, Index& field, Range range, const char*, const char*) {
    field = cursor.integer(name, field, lowest(range), highest(range));
  }
  void operator()(const char* name, bool& field, const char*) { field = cursor.boolean(name, field); }
  void operator()(const char* name, std::string& field, const Choices& choices, const char*) {
    if (auto member = cursor.find(name))
      field = choices.names.empty() ? member->string() : member->one_of(choices.names);
  }
  void operator()(const char* name, std::vector<std::string>& field, const Choices& choices, const char*);
  void operator()(const char* name, std::pair<double, double>& field, Range range, const char*, const char*);
};

struct OptionWriter {
  Json out = Json::object();
  void operator()(const char* name, double& field, Range, const char*, const char*) { out[name] = field; }
  void operator()(const char* name, std::optional<double>& field, Range, const char*, const char*) {
    out[name] = field ? Json(*field) : Json();
  }
  void operator()(const char* name, Index& field, Range, const char*, const char*) { out[name] = field; }
  void operator()(const char* name, bool& field, const char*) { out[name] = field; }
  void operator()(const char* name, std::string& field, const Choices&, const char*) { out[name] = field; }
  void operator()(const char* name, std::vector<std::string>& field, const Choices&, const char*) { out[name] = field; }
  void operator()(const char* name, std::pair<double, double>& field, Range, const char*, const char*) {
    out[name] = {field.first, field.second};
  }
};

struct OptionLister {
  std::vector<OptionInfo> out;
  static std::string text(Range range);
  static std::string text(const Choices& choices);
  void operator()(const char* name, double& field, Range range, const char* unit, const char* meaning) {
    out.push_back({name, field, unit, text(range), meaning});
  }
  void operator()(const char* name, std::optional<double>& field, Range range, const char* unit, const char* meaning) {
    out.push_back({name, field ? Json(*field) : Json(), unit, text(range) + ", or null", meaning});
  }
  void operator()(const char* name, Index& field, Range range, const char* unit, const char* meaning) {
    out.push_back({name, field, unit, text(range), meaning});
  }
  void operator()(const char* name, bool& field, const char* meaning) {
    out.push_back({name, field, "-", "true or false", meaning});
  }
  void operator()(const char* name, std::string& field, const Choices& choices, const char* meaning);
  void operator()(const char* name, std::vector<std::string>& field, const Choices& choices, const char* meaning) {
    out.push_back({name, field, "-", "list of " + text(choices), meaning});
  }
  void operator()(const char* name, std::pair<double, double>& field, Range range, const char* unit,
                  const char* meaning) {
    out.push_back({name, {field.first, field.second}, unit, "[low, high] in " + text(range), meaning});
  }
};

}  // namespace detail

/// Reads the fields present in `cursor` over their defaults. Keys that no field claims are left for `cursor.done()`.
template <class Options>
Options read_options(const JsonCursor& cursor, Options options = {}) {
  detail::OptionReader reader{cursor};
  options.fields(reader);
  return options;
}

/// The effective options, defaults filled in.
template <class Options>
Json write_options(Options options) {
  detail::OptionWriter writer;
  options.fields(writer);
  return writer.out;
}

/// Name, default, unit, range and meaning of every field.
template <class Options>
std::vector<OptionInfo> describe_options(Options options = {}) {
  detail::OptionLister lister;
  options.fields(lister);
  return lister.out;
}

}  // namespace wheelhop
