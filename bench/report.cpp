#include "bench/report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>

#include "experiments/run/statistics.hpp"

namespace wheelhop::bench {
namespace {

struct Name {
  std::string what, variant, of;
};

/// "WHAT|VARIANT|CASE"; others are a WHAT of ours alone.
Name split(const std::string& name) {
  const std::size_t first = name.find('|');
  if (first == std::string::npos) return {name, kOurs, ""};
  const std::size_t second = name.find('|', first + 1);
  return {name.substr(0, first), name.substr(first + 1, second - first - 1), name.substr(second + 1)};
}

struct Size {
  double value;
  std::string rest;  // of the case
};

/// "N=20k s=20" is {20000, "s=20"}.
std::optional<Size> size_of(const std::string& of) {
  const std::size_t equals = of.find('='), end = std::min(of.find(' '), of.size());
  if (equals == std::string::npos || equals > end) return std::nullopt;
  double value = 0;
  const auto [rest, error] = std::from_chars(of.data() + equals + 1, of.data() + end, value);
  if (error != std::errc() || !(value > 0)) return std::nullopt;
  const std::string unit(rest, of.data() + end);
  value *= unit == "k" ? 1e3 : unit == "M" ? 1e6 : 1;
  return Size{value, end < of.size() ? of.substr(end + 1) : of.substr(0, equals)};
}

}  // namespace

void RatioReporter::ReportRuns(const std::vector<Run>& runs) {
  for (const Run& run : runs) {
    if (run.run_type == Run::RT_Aggregate) continue;
    const std::string name = run.run_name.function_name + (run.run_name.args.empty() ? "" : "/" + run.run_name.args);
    const auto [at, is_new] = measured_.try_emplace(name);
    if (is_new) order_.push_back(name);
    if (run.error_occurred) {
      at->second.error = run.error_message;
      continue;
    }
    at->second.ms.push_back(1e3 * run.cpu_accumulated_time / static_cast<double>(run.iterations));
    for (const auto& [key, counter] : run.counters) at->second.counters[key] = counter.value;
    if (at->second.ms.size() == 1) fmt::print(stderr, "bench: {}\n", name);
  }
}

double RatioReporter::median_of(const std::string& name) const {
  const auto at = measured_.find(name);
  if (at == measured_.end() || at->second.ms.empty()) return 0;
  std::vector<double> ms = at->second.ms;
  std::sort(ms.begin(), ms.end());
  return quantile(ms, 0.5);
}

Json RatioReporter::complexity() const {
  // By quantity, WHAT, VARIANT and the rest of the case: size and value.
  std::map<std::tuple<std::string, std::string, std::string, std::string>, std::map<double, double>> series;
  for (const std::string& name : order_) {
    const Name parts = split(name);
    const std::optional<Size> size = size_of(parts.of);
    if (!size) continue;
    if (const double ms = median_of(name); ms > 0)
      series[{"time", parts.what, parts.variant, size->rest}][size->value] = ms;
    const Measured& one = measured_.at(name);
    if (const auto peak = one.counters.find("peak_mb"); peak != one.counters.end() && peak->second > 0)
      series[{"peak_mb", parts.what, parts.variant, size->rest}][size->value] = peak->second;
  }
  Json list = Json::array();
  fmt::print("\n{:<8} {:<34} {:<24} {:<14} {:<20} {:>8}\n", "grows", "as size^exponent", "variant", "case", "sizes",
             "exponent");
  for (const auto& [key, points] : series) {
    if (points.size() < 3) continue;
    const auto& [quantity, what, variant, rest] = key;
    double x = 0, y = 0, xx = 0, xy = 0;
    const auto count = static_cast<double>(points.size());
    for (const auto& [size, value] : points) {
      x += std::log(size) / count;
      y += std::log(value) / count;
    }
    for (const auto& [size, value] : points) {
      xx += (std::log(size) - x) * (std::log(size) - x);
      xy += (std::log(size) - x) * (std::log(value) - y);
    }
    const double least = points.begin()->first, largest = points.rbegin()->first;
    fmt::print("{:<8} {:<34} {:<24} {:<14} {:<20} {:>8.2f}\n", quantity, what, variant, rest,
               fmt::format("{:g} to {:g}", least, largest), xy / xx);
    list.push_back({{"quantity", quantity},
                    {"what", what},
                    {"variant", variant},
                    {"case", rest},
                    {"sizes", {least, largest}},
                    {"exponent", xy / xx}});
  }
  return list;
}

Json RatioReporter::finish() {
  Json list = Json::array();
  std::sort(order_.begin(), order_.end(), [](const std::string& a, const std::string& b) {
    const Name x = split(a), y = split(b);
    return std::tuple(x.what, x.of, x.variant != kOurs, x.variant) <
           std::tuple(y.what, y.of, y.variant != kOurs, y.variant);
  });
  fmt::print("{:<34} {:<20} {:<24} {:>10} {:>10} {:>8}\n", "what", "case", "variant", "ms", "spread", "ratio");
  for (const std::string& name : order_) {
    const Name parts = split(name);
    Measured& one = measured_[name];
    Json item = {{"what", parts.what}, {"case", parts.of}, {"variant", parts.variant}};
    if (one.ms.empty()) {
      item["failed"] = one.error;
      fmt::print("{:<34} {:<20} {:<24} failed: {}\n", parts.what, parts.of, parts.variant, one.error);
      list.push_back(std::move(item));
      continue;
    }
    std::sort(one.ms.begin(), one.ms.end());
    const double median = quantile(one.ms, 0.5), low = quantile(one.ms, 0.05), high = quantile(one.ms, 0.95);
    item["ms"] = {{"median", median}, {"q05", low}, {"q95", high}};
    item["repetitions"] = one.ms.size();
    for (const auto& [key, value] : one.counters) item[key] = value;
    const double ours = median_of(parts.what + "|" + kOurs + "|" + parts.of);
    std::string ratio;
    if (parts.variant != kOurs && ours > 0) {
      item["ratio"] = median / ours;
      ratio = fmt::format("{:.3g}", median / ours);
    }
    std::string counters;
    for (const auto& [key, value] : one.counters) counters += fmt::format("  {} {:.2g}", key, value);
    fmt::print("{:<34} {:<20} {:<24} {:>10.4g} {:>9.0f}% {:>8}{}\n", parts.what, parts.of, parts.variant, median,
               100 * (high - low) / median, ratio, counters);
    list.push_back(std::move(item));
  }
  return list;
}

}  // namespace wheelhop::bench
