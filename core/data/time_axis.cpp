#include "core/data/time_axis.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <string>
#include <vector>

#include "core/base/status.hpp"
#include "core/data/table.hpp"

namespace wheelhop {
namespace {

constexpr double kTolerance = 1e-4;  // of a period for an instant, relative for the rate

/// Decimals and significant digits that the instants need, both as large as any of them needs.
struct Digits {
  int decimals = 0;
  int significant = 1;
};

Digits digits_of(ConstVectorRef t_s) {
  Digits digits;
  for (const double t : t_s) {
    if (t == 0) continue;
    const std::string text = fmt::format("{:.17e}", t);
    const std::string shortest = fmt::format("{}", t);
    // The shortest decimal form, as digits and exponent: "0.0016384" has 5 digits, the first worth 10^-3.
    std::string mantissa = shortest.substr(0, shortest.find('e'));
    std::erase_if(mantissa, [](char c) { return c < '0' || c > '9'; });
    mantissa.erase(0, mantissa.find_first_not_of('0'));
    mantissa.erase(mantissa.find_last_not_of('0') + 1);
    const int exponent = std::atoi(text.c_str() + text.find('e') + 1);
    const int count = static_cast<int>(mantissa.size());
    digits.significant = std::max(digits.significant, count);
    digits.decimals = std::max(digits.decimals, count - 1 - exponent);
  }
  return digits;
}

/// Step of the coarsest instant when written with these digits: its last decimal, or its last significant digit.
double resolution(ConstVectorRef t_s) {
  const Digits digits = digits_of(t_s);
  const double largest = std::max(std::abs(t_s(0)), std::abs(t_s(t_s.size() - 1)));
  const int exponent = largest > 0 ? static_cast<int>(std::floor(std::log10(largest))) : -digits.decimals;
  return std::pow(10.0, std::max(-digits.decimals, exponent + 1 - digits.significant));
}

/// First instant at which the offsets t_k - k period seen so far spread over more than `allowed`; -1 if none does.
Index first_break(ConstVectorRef t_s, double period, double allowed) {
  double low = 0, high = 0;
  for (Index k = 1; k < t_s.size(); ++k) {
    const double offset = t_s(k) - t_s(0) - static_cast<double>(k) * period;
    low = std::min(low, offset);
    high = std::max(high, offset);
    if (high - low > allowed) return k;
  }
  return -1;
}

/// What rounding to `step` can explain: nothing if the grid falls on the steps, else offsets over one step.
double explained(double period, double step) {
  const double steps = period / step;
  return std::abs(steps - std::round(steps)) < 1e-6 ? 0 : step;
}

/// Slope of the least-squares line through the instants.
double mean_period(ConstVectorRef t_s) {
  const Index n = t_s.size();
  const Vector k = Vector::LinSpaced(n, -0.5 * static_cast<double>(n - 1), 0.5 * static_cast<double>(n - 1));
  return k.dot((t_s.array() - t_s.mean()).matrix()) / k.squaredNorm();
}

double median_step(ConstVectorRef t_s) {
  std::vector<double> steps;
  for (Index k = 1; k < t_s.size(); ++k) steps.push_back(t_s(k) - t_s(k - 1));
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return *middle;
}

}  // namespace

void check_time_axis(ConstVectorRef t_s, double sampling_hz, const std::filesystem::path& file, Index first) {
  const std::string name = file.string();
  const Index n = t_s.size();
  for (Index k = 1; k < n; ++k)
    if (!(t_s(k) > t_s(k - 1)))
      throw UserError(fmt::format("{}: {}: expected t to increase, found {} after {}", name,
                                  place_of_sample(file, first + k), t_s(k), t_s(k - 1)));
  const double claimed = 1 / sampling_hz;
  if (first_break(t_s, claimed, kTolerance * claimed) < 0) return;
  // Digits cost far more than arithmetic, and most grids are through by now.
  const double step = resolution(t_s);
  if (first_break(t_s, claimed, std::max(kTolerance * claimed, (1 + 1e-9) * explained(claimed, step))) < 0) return;
  // Uniform at a rate of its own? Rounding also tilts the fitted line, by less than 3 / sqrt(N) steps in all.
  const double period = mean_period(t_s);
  const double allowed =
      std::max(2 * kTolerance * period, (1 + 3 / std::sqrt(static_cast<double>(n))) * explained(period, step));
  Index broken = first_break(t_s, period, allowed);
  if (broken >= 0) {
    const double typical = median_step(t_s);
    const double grid = std::abs(typical * sampling_hz - 1) < 0.05 ? claimed : typical;
    const Index jump = first_break(t_s, grid, std::max(kTolerance * grid, (1 + 1e-9) * explained(grid, step)));
    if (jump >= 0) broken = jump;
    throw UserError(
        fmt::format("{}: {}: expected uniform sampling, found a step of {:.6g} s in t where {:.6g} s is usual", name,
                    place_of_sample(file, first + broken), t_s(broken) - t_s(broken - 1), typical));
  }
  const double difference = std::abs(t_s(n - 1) - t_s(0) - static_cast<double>(n - 1) * claimed);
  if (difference > kTolerance * static_cast<double>(n - 1) * claimed + explained(period, step))
    throw UserError(fmt::format("{}: {}: expected t at sampling_hz = {:.9g} Hz, found {:.9g} Hz", name,
                                place_of_sample(file, first + 1), sampling_hz, 1 / period));
}

}  // namespace wheelhop
