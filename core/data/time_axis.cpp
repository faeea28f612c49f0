#include "core/data/time_axis.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/base/status.hpp"

namespace wheelhop {
namespace {

constexpr double kTolerance = 1e-4;  // of a period for an instant, relative for the rate
// Judgements: instants off by 2 % of a period (RMS) err by 1.3 % of the signal at a tenth of the sampling rate; of
// numbers drawn from a normal distribution one in 5e8 lies beyond six times their RMS.
constexpr double kUsualScatter = 0.02, kNoiseCrest = 6;
// Of four gaps at random places in 2000 samples, rounding explained none in 300 draws.
constexpr Index kFewGaps = 3;
constexpr std::size_t kPlacesTold = 5;

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

/// Whether every instant is a float32, as far as its nine digits tell.
bool are_single(ConstVectorRef t_s) {
  for (const double t : t_s) {
    if (t == 0) continue;
    const double digit = std::pow(10.0, std::floor(std::log10(std::abs(t))) - 8);
    if (std::abs(t - static_cast<double>(static_cast<float>(t))) > 0.51 * digit) return false;
  }
  return true;
}

/// Distance of neighbouring float32 at the largest instant.
double single_step(double largest) { return largest > 0 ? std::ldexp(1.0, std::ilogb(largest) - 23) : 0; }

/// Steps that the instants are rounded to.
struct Resolution {
  double decimal = 0;  ///< of the coarsest instant: its last decimal, or its last significant digit
  double single = 0;   ///< last bit of the largest one, if all are float32; else 0
};

Resolution resolution(ConstVectorRef t_s) {
  const Digits digits = digits_of(t_s);
  const double largest = std::max(std::abs(t_s(0)), std::abs(t_s(t_s.size() - 1)));
  const int exponent = largest > 0 ? static_cast<int>(std::floor(std::log10(largest))) : -digits.decimals;
  const double decimal = std::pow(10.0, std::max(-digits.decimals, exponent + 1 - digits.significant));
  return {decimal, are_single(t_s) ? single_step(largest) : 0};
}

/// First instant at which the offsets t_k - places_k period seen so far spread over more than `allowed`; -1 if none
/// does.
Index first_break(ConstVectorRef t_s, ConstVectorRef places, double period, double allowed) {
  double low = 0, high = 0;
  for (Index k = 1; k < t_s.size(); ++k) {
    const double offset = t_s(k) - t_s(0) - (places(k) - places(0)) * period;
    low = std::min(low, offset);
    high = std::max(high, offset);
    if (!(high - low <= allowed)) return k;
  }
  return -1;
}

/// The period between `low` and `high` from whose grid the offsets spread least. The spread is convex in the period, so
/// that thirds close in on it.
double narrowest_period(ConstVectorRef t_s, ConstVectorRef places, double low, double high) {
  const auto spread = [&](double period) {
    const Vector offsets = t_s - period * places;
    return offsets.maxCoeff() - offsets.minCoeff();
  };
  for (int i = 0; i < 60; ++i) {
    const double one = low + (high - low) / 3, other = high - (high - low) / 3;
    if (spread(one) < spread(other))
      high = other;
    else
      low = one;
  }
  return 0.5 * (low + high);
}

/// What rounding to `step` can explain: nothing if the grid falls on the steps, else offsets over one step.
double explained(double period, double step) {
  const double steps = period / step;
  return std::abs(steps - std::round(steps)) < 1e-6 ? 0 : step;
}

/// Least-squares line through instants over their numbers on the grid.
struct FittedLine {
  double start = 0, period = 0;
  double largest = 0, rms = 0;  ///< distances from it, in periods
  double slope_error = 0;       ///< standard error of the period, relative
};

FittedLine fit_line(ConstVectorRef t_s, ConstVectorRef places) {
  const Vector k = (places.array() - places.mean()).matrix();
  FittedLine line;
  line.period = k.dot((t_s.array() - t_s.mean()).matrix()) / k.squaredNorm();
  line.start = t_s.mean() - line.period * places.mean();
  const Vector off = (t_s - line.period * places).array() - line.start;
  line.largest = off.cwiseAbs().maxCoeff() / line.period;
  line.rms = off.norm() / std::sqrt(static_cast<double>(t_s.size())) / line.period;
  line.slope_error = line.rms / k.norm();
  return line;
}

Vector counted(Index n) { return Vector::LinSpaced(n, 0, static_cast<double>(n - 1)); }

double median_step(ConstVectorRef t_s) {
  std::vector<double> steps;
  for (Index k = 1; k < t_s.size(); ++k) steps.push_back(t_s(k) - t_s(k - 1));
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return *middle;
}

/// Division by a power of ten gives the double nearest to a short decimal; a product does not.
Vector in_seconds(ConstVectorRef t, double unit_s) {
  const double units = std::round(1 / unit_s);
  return unit_s < 1 && std::abs(units * unit_s - 1) < 1e-12 ? Vector(t / units) : Vector(t * unit_s);
}

class TimeAxis {
 public:
  /// Both live longer than this.
  TimeAxis(const ConstVectorRef& t, const TimeRequest& request)
      : raw_(t), t_(in_seconds(t, request.unit_s)), request_(request), whole_(counted(t.size())) {}

  TimeGrid fit() {
    const double claimed = request_.sampling_hz ? 1 / *request_.sampling_hz : 0;
    // Digits cost far more than arithmetic, and most grids are through at once.
    if (claimed > 0 && first_break(t_, whole_, claimed, kTolerance * claimed) < 0)
      return {*request_.sampling_hz, {}, 0};
    if (claimed > 0 && first_break(t_, whole_, claimed, allowed(claimed)) < 0) return {*request_.sampling_hz, {}, 0};
    FittedLine line = fit_line(t_, whole_);
    if (is_grid(whole_, line)) {
      const auto lossy = with_hidden_losses(claimed, line.period);
      return lossy ? *lossy : at_rate(whole_, line, 0);
    }
    require_increase();
    if (is_scatter(line)) return at_rate(whole_, line, line.largest);
    if (const auto lossy = with_lost_samples(claimed)) return *lossy;
    refuse(claimed, line);
  }

 private:
  const Resolution& steps() {
    if (!steps_) {
      steps_ = resolution(raw_);  // as the file writes them
      steps_->decimal *= request_.unit_s;
      steps_->single *= request_.unit_s;
    }
    return *steps_;
  }

  /// Spread of the offsets from a grid of this period that rounding explains: to float32, which are then written with
  /// so many digits, or to digits alone.
  double rounding(double period) {
    const double single = steps().single > 0 ? explained(period, steps().single) : 0;
    return single > 0 ? single + steps().decimal : explained(period, steps().decimal);
  }

  /// What doubles of this size add to the spread: half a last bit either side, of an instant and of the first one.
  double last_bits() const { return 2 * std::numeric_limits<double>::epsilon() * t_.cwiseAbs().maxCoeff(); }

  /// Spread of the offsets from a grid whose rate is known.
  double allowed(double period) { return std::max(kTolerance * period, (1 + 1e-9) * rounding(period) + last_bits()); }

  /// Is it a grid of the fitted period, or, where there is rounding, of one near it? Rounding tilts a fitted line, so
  /// that the period is then the one from which the offsets spread least.
  bool is_grid(ConstVectorRef places, FittedLine& line) {
    if (!(line.period > 0)) return false;
    if (first_break(t_, places, line.period, 2 * kTolerance * line.period) < 0) return true;
    const double explains = rounding(line.period);
    if (explains == 0) return false;
    const double reach = 2 * explains / (places(places.size() - 1) - places(0));
    const double period = narrowest_period(t_, places, line.period - reach, line.period + reach);
    if (first_break(t_, places, period, (1 + 1e-6) * explains + last_bits()) >= 0) return false;
    line.period = period;
    return true;
  }

  bool is_scatter(const FittedLine& line) const {
    if (!(line.period > 0)) return false;
    if (request_.scatter) return line.largest <= *request_.scatter;
    return line.rms <= kUsualScatter && line.largest <= kNoiseCrest * line.rms;
  }

  void require_increase() const {
    for (Index k = 1; k < t_.size(); ++k)
      if (!(t_(k) > t_(k - 1)))
        throw UserError(fmt::format("{}: {}: expected {} to increase, found {} after {}", request_.file,
                                    request_.place(k), request_.name, t_(k), t_(k - 1)));
  }

  /// The grid at the rate asked for, or at the plainest one that fits the line.
  TimeGrid at_rate(ConstVectorRef places, const FittedLine& line, double scatter) {
    TimeGrid grid{1 / line.period, {}, scatter};
    const double span = places(places.size() - 1) - places(0);
    const double slack = scatter > 0 ? 4 * line.slope_error : rounding(line.period) / (span * line.period);
    if (request_.sampling_hz) {
      grid.sampling_hz = *request_.sampling_hz;
      if (std::abs(line.period * grid.sampling_hz - 1) > kTolerance + slack) refuse_rate(line.period);
      return grid;
    }
    const auto fits = [&](double period) {
      if (scatter > 0) return std::abs(period / line.period - 1) <= slack;
      return first_break(t_, places, period, allowed(period)) < 0;
    };
    for (int digits = 1; digits <= 12; ++digits) {
      const double hz = rounded(1 / line.period, digits), period = rounded(line.period, digits);
      if (fits(1 / hz))
        grid.sampling_hz = hz;
      else if (fits(period))
        grid.sampling_hz = 1 / period;
      else
        continue;
      break;
    }
    return grid;
  }

  static double rounded(double value, int digits) {
    return std::strtod(fmt::format("{:.{}e}", value, digits - 1).c_str(), nullptr);
  }

  [[noreturn]] void refuse_rate(double period) const {
    const double factor = *request_.sampling_hz * period;
    std::string hint;
    for (const auto& [name, size] : {std::pair{"ms", 1e3}, {"us", 1e6}, {"ns", 1e9}, {"min", 1.0 / 60}})
      if (std::abs(factor / size - 1) < 1e-3)
        hint = fmt::format("; if {} is in {}, say \"time\": {{\"unit\": \"{}\"}}", request_.name, name, name);
    throw UserError(fmt::format("{}: {}: expected {} at sampling_hz = {:.9g} Hz, found {:.9g} Hz{}", request_.file,
                                request_.place(1), request_.name, *request_.sampling_hz, 1 / period, hint));
  }

  /// Numbers of the instants on a grid with gaps. Follows the grid by a running mean of the offsets, which begins with
  /// the median of the first ones, so that neither rounding nor a period that is slightly off adds up.
  Vector places_with_gaps(double period) const {
    constexpr double forget = 0.1;
    std::vector<double> offsets;
    for (Index k = 0; k < std::min<Index>(t_.size(), 31); ++k)
      offsets.push_back(t_(k) - period * static_cast<double>(k));
    std::sort(offsets.begin(), offsets.end());
    double start = offsets[offsets.size() / 2];
    Vector places = Vector::Zero(t_.size());
    for (Index k = 1; k < t_.size(); ++k) {
      const double passed = std::round((t_(k) - start) / period - places(k - 1));
      places(k) = places(k - 1) + std::max(1.0, passed);
      start += forget * (t_(k) - period * places(k) - start);
    }
    return places;
  }

  /// Mean of the steps up to `longest`.
  double mean_step(double longest) const {
    double sum = 0;
    Index count = 0;
    for (Index k = 1; k < t_.size(); ++k)
      if (const double own = t_(k) - t_(k - 1); own < longest) {
        sum += own;
        ++count;
      }
    return sum / static_cast<double>(count);
  }

  std::optional<TimeGrid> with_lost_samples(double claimed) {
    // Steps over one period are those about the usual one, of which rounding makes some longer.
    const double typical = median_step(t_);
    for (const double longest : {1.5 * typical, typical + 1.5 * steps().decimal}) {
      const double mean = mean_step(longest);
      const double period = claimed > 0 && std::abs(mean / claimed - 1) < 0.05 ? claimed : mean;
      if (const auto grid = with_lost_samples_at(period, typical)) return grid;
    }
    return {};
  }

  /// Where instants are rounded to steps of half a period or more, a few lost samples and a period that is slightly
  /// longer look alike. The grid of whole steps with gaps is taken, which leaves nothing to explain; who knows better
  /// says so by the rate. Many gaps that rounding explains as well are as evenly spaced as no losses are.
  std::optional<TimeGrid> with_hidden_losses(double claimed, double fitted) {
    if (rounding(fitted) < 0.5 * fitted) return {};
    const double typical = median_step(t_);
    if (!(typical > 0)) return {};
    const double period = claimed > 0 && std::abs(typical / claimed - 1) < 0.05 ? claimed : typical;
    if (rounding(period) > 0) return {};
    const Vector places = places_with_gaps(period);
    Index gaps = 0;
    for (Index k = 1; k < places.size(); ++k) gaps += places(k) - places(k - 1) > 1;
    if (gaps > kFewGaps) return {};
    return with_lost_samples_at(period, typical);
  }

  std::optional<TimeGrid> with_lost_samples_at(double period, double typical) {
    if (rounding(period) >= period) return {};  // a lost sample and rounding look the same
    const Vector places = places_with_gaps(period);
    const Index n = t_.size();
    if (places(n - 1) == static_cast<double>(n - 1)) return {};
    FittedLine line = fit_line(t_, places);
    const bool grid = is_grid(places, line);
    if (!grid && !is_scatter(line)) return {};
    TimeGrid result = at_rate(places, line, grid ? 0 : line.largest);
    for (Index k = 1; k < n; ++k)
      if (const auto more = static_cast<Index>(places(k) - places(k - 1)) - 1; more > 0)
        result.lost.push_back({k, more});
    if (!request_.may_lose) refuse_lost(result, typical);
    return result;
  }

  std::string step_at(Index k, double typical) const {
    return fmt::format("{}: {}: expected uniform sampling, found a step of {:.6g} s in {} where {:.6g} s is usual",
                       request_.file, request_.place(k), t_(k) - t_(k - 1), request_.name, typical);
  }

  [[noreturn]] void refuse_lost(const TimeGrid& grid, double typical) const {
    Index total = 0;
    std::string places;
    for (std::size_t i = 0; i < grid.lost.size(); ++i) {
      total += grid.lost[i].count;
      if (i < kPlacesTold)
        places += fmt::format("{}{} at {}", i ? ", " : "", grid.lost[i].count, request_.place(grid.lost[i].before));
    }
    throw UserError(fmt::format(
        "{}; lost samples: {} ({}{}); say \"lost_samples\": \"bridge\" to interpolate them or \"cut\" to keep the "
        "longest stretch that has none, or take a \"range\" without them",
        step_at(grid.lost.front().before, typical), total, places, grid.lost.size() > kPlacesTold ? ", ..." : ""));
  }

  [[noreturn]] void refuse(double claimed, const FittedLine& line) {
    const double typical = median_step(t_);
    const double grid = claimed > 0 && std::abs(typical / claimed - 1) < 0.05 ? claimed : typical;
    Index broken = first_break(t_, whole_, grid, allowed(grid));
    if (broken < 0) broken = first_break(t_, whole_, line.period, 2 * kTolerance * line.period);
    throw UserError(fmt::format(
        "{}{}", step_at(std::max<Index>(broken, 1), typical),
        line.period > 0 && line.largest < most_scatter
            ? fmt::format("; if only the instants scatter and the samples lie on an even grid, say \"time\": "
                          "{{\"scatter\": {:g}}}, in periods",
                          std::ceil(105 * line.largest) / 100)
            : ""));
  }

  const ConstVectorRef& raw_;
  Vector t_;
  const TimeRequest& request_;
  Vector whole_;
  std::optional<Resolution> steps_;
};

}  // namespace

TimeGrid fit_time_grid(ConstVectorRef t, const TimeRequest& request) { return TimeAxis(t, request).fit(); }

}  // namespace wheelhop
