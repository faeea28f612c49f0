#include "bench/report.hpp"

#include <fmt/format.h>

#include <algorithm>

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

Json RatioReporter::finish() {
  const auto median_of = [&](const std::string& name) {
    const auto at = measured_.find(name);
    if (at == measured_.end() || at->second.ms.empty()) return 0.0;
    std::vector<double> ms = at->second.ms;
    std::sort(ms.begin(), ms.end());
    return quantile(ms, 0.5);
  };
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
