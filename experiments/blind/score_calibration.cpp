#include "experiments/blind/score_calibration.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace wheelhop::scoring {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

void add_up(Calibration& result, std::vector<Forecast>::const_iterator begin, std::vector<Forecast>::const_iterator end,
            double total) {
  CalibrationBin bin{begin->probability, std::prev(end)->probability, 0, {0, end - begin}};
  double variance = 0;
  for (auto forecast = begin; forecast != end; ++forecast) {
    bin.confidence += forecast->probability;
    bin.right.hits += forecast->right;
    variance += forecast->probability * (1 - forecast->probability);
  }
  const double n = static_cast<double>(bin.right.n);
  bin.confidence /= n;
  result.ece += n / total * std::abs(bin.right.value() - bin.confidence);
  result.ece_by_chance += n / total * std::sqrt(2 / M_PI * variance) / n;  // mean of |N(0, variance / n^2)|
  result.bins.push_back(bin);
}

}  // namespace

std::pair<double, double> wilson_interval(Rate rate) {
  if (rate.n == 0) return {0, 1};
  constexpr double z = 1.959963984540054;
  const double n = static_cast<double>(rate.n), p = rate.value();
  const double centre = p + z * z / (2 * n), half = z * std::sqrt(p * (1 - p) / n + z * z / (4 * n * n));
  return {std::max(0.0, (centre - half) / (1 + z * z / n)), std::min(1.0, (centre + half) / (1 + z * z / n))};
}

Calibration calibrate(std::vector<Forecast> forecasts) {
  Calibration result;
  if (forecasts.empty()) {
    result.ece = result.ece_by_chance = result.brier = result.brier_skill = kNaN;
    return result;
  }
  std::sort(forecasts.begin(), forecasts.end(),
            [](const Forecast& a, const Forecast& b) { return a.probability < b.probability; });
  const std::size_t n = forecasts.size(), bins = std::clamp<std::size_t>(n / 10, 1, 10);
  // Forecasts of one probability go where their middle lies.
  std::vector<std::size_t> bin(n);
  for (std::size_t first = 0, last = 0; first < n; first = last) {
    while (last < n && forecasts[last].probability == forecasts[first].probability) ++last;
    for (std::size_t i = first; i < last; ++i) bin[i] = (first + last) * bins / (2 * n);
  }
  const double total = static_cast<double>(n);
  for (std::size_t first = 0, last = 0; first < n; first = last) {
    while (last < n && bin[last] == bin[first]) ++last;
    add_up(result, forecasts.begin() + static_cast<std::ptrdiff_t>(first),
           forecasts.begin() + static_cast<std::ptrdiff_t>(last), total);
  }
  double right = 0;
  for (const Forecast& forecast : forecasts) {
    const double error = forecast.probability - (forecast.right ? 1 : 0);
    result.brier += error * error / total;
    right += forecast.right ? 1 / total : 0;
  }
  const double base = right * (1 - right);
  result.brier_skill = base < 1e-12 ? kNaN : 1 - result.brier / base;
  return result;
}

double median(std::vector<double> values) {
  if (values.empty()) return kNaN;
  std::sort(values.begin(), values.end());
  const std::size_t half = values.size() / 2;
  if (values.size() % 2 == 1 || values[half - 1] == values[half]) return values[half];
  return (values[half - 1] + values[half]) / 2;
}

}  // namespace wheelhop::scoring
