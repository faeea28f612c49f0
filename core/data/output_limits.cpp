#include "core/data/output_limits.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace wheelhop {
namespace {

constexpr Index kLongEnough = 3, kSamples = 10, kPlaces = 2;
constexpr double kSteps = 3;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Typical least distance between two values that a channel takes: a hundredth of the distances are smaller.
double resolution_of(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  std::vector<double> distances;
  for (std::size_t i = 1; i < values.size(); ++i)
    if (values[i] > values[i - 1]) distances.push_back(values[i] - values[i - 1]);
  if (distances.empty()) return 0;
  const auto place = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 100);
  std::nth_element(distances.begin(), place, distances.end());
  return *place;
}

/// Whether channel i was cut off at its highest value, with sign -1 at its lowest.
bool is_cut_off(const std::vector<ConstMatrixRef>& outputs, Index i, double sign, double highest, double resolution) {
  Index samples = 0;
  std::vector<double> changes;
  for (const ConstMatrixRef& y : outputs) {
    Index first = 0;
    for (Index k = 0; k <= y.cols(); ++k) {
      if (k < y.cols() && sign * y(i, k) == highest) continue;
      if (k - first >= kLongEnough && first > 0 && k < y.cols()) {
        samples += k - first;
        changes.push_back(std::min(highest - sign * y(i, first - 1), highest - sign * y(i, k)));
      }
      first = k + 1;
    }
  }
  if (static_cast<Index>(changes.size()) < kPlaces || samples < kSamples) return false;
  const auto middle = changes.begin() + static_cast<std::ptrdiff_t>(changes.size() / 2);
  std::nth_element(changes.begin(), middle, changes.end());
  return *middle > kSteps * resolution;
}

}  // namespace

OutputLimits find_output_limits(const std::vector<ConstMatrixRef>& outputs) {
  const Index p = outputs.empty() ? 0 : outputs.front().rows();
  OutputLimits limits{Vector::Constant(p, -kInfinity), Vector::Constant(p, kInfinity)};
  bool any = false;
  for (Index i = 0; i < p; ++i) {
    std::vector<double> values;
    for (const ConstMatrixRef& y : outputs)
      for (Index k = 0; k < y.cols(); ++k) values.push_back(y(i, k));
    if (values.empty()) continue;
    const double resolution = resolution_of(values);
    const auto [low, high] = std::minmax_element(values.begin(), values.end());
    if (is_cut_off(outputs, i, 1, *high, resolution)) limits.high(i) = *high;
    if (is_cut_off(outputs, i, -1, -*low, resolution)) limits.low(i) = *low;
    any = any || std::isfinite(limits.high(i)) || std::isfinite(limits.low(i));
  }
  return any ? limits : OutputLimits{};
}

OutputLimits over(const OutputLimits& limits, const Vector& scale) {
  if (!limits.any()) return {};
  return {limits.low.cwiseQuotient(scale), limits.high.cwiseQuotient(scale)};
}

void cut_off(const OutputLimits& limits, MatrixRef y) {
  if (!limits.any()) return;
  for (Index k = 0; k < y.cols(); ++k) y.col(k) = y.col(k).cwiseMax(limits.low).cwiseMin(limits.high);
}

void excuse_beyond(const OutputLimits& limits, ConstMatrixRef y, MatrixRef error) {
  if (!limits.any()) return;
  for (Index k = 0; k < y.cols(); ++k)
    for (Index i = 0; i < y.rows(); ++i)
      if (lies_beyond(limits, i, y(i, k), error(i, k))) error(i, k) = 0;
}

}  // namespace wheelhop
