#include "experiments/run/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace wheelhop {

double quantile(const std::vector<double>& ascending, double p) {
  const double place = p * static_cast<double>(ascending.size() - 1);
  const auto below = static_cast<std::size_t>(place), above = std::min(below + 1, ascending.size() - 1);
  const double weight = place - static_cast<double>(below);
  const double low = ascending[below], high = ascending[above];
  if (weight == 0 || low == high) return low;
  if (std::isinf(low) || std::isinf(high)) {
    if (weight != 0.5) return weight < 0.5 ? low : high;
    return std::isinf(low) && std::isinf(high) ? 0 : std::isinf(low) ? low : high;
  }
  return low + weight * (high - low);
}

Statistics statistics_of(std::vector<double> values) {
  Statistics s{0, 0, 0, 0, 0, static_cast<Index>(values.size())};
  for (double& value : values) {
    if (std::isfinite(value))
      ++s.n_ok;
    else
      value = -std::numeric_limits<double>::infinity();
  }
  std::sort(values.begin(), values.end());
  s.median = quantile(values, 0.5);
  s.q05 = quantile(values, 0.05);
  s.q95 = quantile(values, 0.95);
  s.min = values.front();
  return s;
}

}  // namespace wheelhop
