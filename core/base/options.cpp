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

void OptionLister::operator()(const char* name, std::string& field, const Choices& choices, const char* meaning) {
  std::string range = "any text";
  if (!choices.names.empty()) {
    range.clear();
    for (const std::string& choice : choices.names) range += (range.empty() ? "" : " | ") + choice;
  }
  out.push_back({name, field, "-", range, meaning});
}

}  // namespace wheelhop::detail
