#include "core/base/options.hpp"

#include <fmt/core.h>

#include <cmath>

namespace wheelhop::detail {

// 2^63 itself is not an Index; comparing with >= keeps the conversion defined.
Index lowest(Range range) {
  constexpr double limit = 9223372036854775808.0;
  return range.low > -limit && range.low < limit ? static_cast<Index>(std::ceil(range.low))
                                                 : std::numeric_limits<Index>::min();
}

Index highest(Range range) {
  constexpr double limit = 9223372036854775808.0;
  return range.high > -limit && range.high < limit ? static_cast<Index>(std::floor(range.high))
                                                   : std::numeric_limits<Index>::max();
}

std::string OptionLister::text(Range range) {
  const bool below = std::isfinite(range.low);
  const bool above = std::isfinite(range.high);
  if (below && above) return fmt::format("[{}, {}]", range.low, range.high);
  if (below) return fmt::format(">= {}", range.low);
  if (above) return fmt::format("<= {}", range.high);
  return "any";
}

std::string OptionLister::text(const Choices& choices) {
  if (choices.names.empty()) return "any text";
  std::string all;
  for (const std::string& choice : choices.names) all += (all.empty() ? "" : " | ") + choice;
  return all;
}

void OptionLister::operator()(const char* name, std::string& field, const Choices& choices, const char* meaning) {
  out.push_back({name, field.empty() ? "required" : field, "-", text(choices), meaning});
}

void OptionReader::operator()(const char* name, std::vector<std::string>& field, const Choices& choices, const char*) {
  const auto member = cursor.find(name);
  if (!member) return;
  field.clear();
  for (const JsonCursor& item : member->items())
    field.push_back(choices.names.empty() ? item.string() : item.one_of(choices.names));
  if (field.empty()) member->fail("a list of at least one of: " + OptionLister::text(choices));
}

void OptionReader::operator()(const char* name, std::pair<double, double>& field, Range range, const char*,
                              const char*) {
  const auto member = cursor.find(name);
  if (!member) return;
  const std::vector<JsonCursor> ends = member->items();
  if (ends.size() != 2) member->fail("[low, high]");
  field = {ends[0].number(range), ends[1].number(range)};
  if (field.first > field.second) member->fail("[low, high] with low <= high");
}

}  // namespace wheelhop::detail
