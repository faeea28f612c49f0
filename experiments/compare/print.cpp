#include "experiments/compare/print.hpp"

#include <fmt/format.h>

#include <cmath>

namespace wheelhop {
namespace {

/// A number of a result; null stands for an infinite one, a method that failed.
std::string text_of(const Json& value) {
  if (!value.is_number()) return "failed";
  const double number = value.get<double>();
  return std::isfinite(number) ? fmt::format("{:.3g}", number) : "failed";
}

std::string p_of(const Json& value) {
  const double p = value.get<double>();
  return p < 1e-20 ? "p < 1e-20" : fmt::format("p = {:.2g}", p);
}

/// "VAF points on axle_acceleration" of "refined_vaf_axle_acceleration", with what stands between number and place.
std::pair<std::string, std::string> unit_and_place(const std::string& metric) {
  const std::size_t vaf = metric.find("_vaf_"), rmse = metric.find("_rmse_");
  if (vaf != std::string::npos) return {" VAF points", " on " + metric.substr(vaf + 5)};
  if (rmse != std::string::npos) return {" RMSE", " on " + metric.substr(rmse + 6)};
  return {"", " in " + metric};
}

std::string where(const Json& at) {
  std::string text;
  for (const auto& [axis, value] : at.items())
    text += fmt::format("{}{} {}", text.empty() ? " at " : ", ", axis,
                        value.is_string() ? value.get<std::string>() : value.dump());
  return text;
}

}  // namespace

std::string sentence_of(const Json& comparison, const Json& pair) {
  const auto [unit, place] = unit_and_place(comparison["metric"].get<std::string>());
  const std::string a = pair["a"].get<std::string>(), b = pair["b"].get<std::string>();
  const std::string verdict = pair["verdict"].get<std::string>();
  const std::string interval = fmt::format("[{}, {}]", text_of(pair["ci95"][0]), text_of(pair["ci95"][1]));
  const std::string what = place + where(comparison["at"]);
  const std::string n = fmt::format("{}", pair["n"].get<std::size_t>());
  const Json& middle = pair["median_difference"];
  const bool finite = middle.is_number() && std::isfinite(middle.get<double>());
  if (verdict == "better") {
    const std::string by =
        finite ? fmt::format(" by {}{} {}", text_of(middle), unit, interval) : ": the other one fails in most pairs";
    return fmt::format("{} beats {}{}{}; {} of {} pairs; {} after correction", a, b, by, what,
                       pair["wins"].get<std::size_t>(), n, p_of(pair["p_holm"]));
  }
  if (verdict == "equivalent")
    return fmt::format("{} and {} are equivalent within {}{}{}; median difference {} {}; {} of {} pairs tie", a, b,
                       text_of(comparison["equivalence"]), unit, what, text_of(middle), interval,
                       pair["ties"].get<std::size_t>(), n);
  if (verdict == "too_few")
    return fmt::format("{} and {}: {} {} too few to tell them apart{}; median difference {}{}", a, b, n,
                       n == "1" ? "realisation is" : "realisations are", what, text_of(middle), unit);
  return fmt::format(
      "{} and {} are not told apart{}; median difference {}{} {}; {} wins, {} ties, {} losses; {} after "
      "correction",
      a, b, what, text_of(middle), unit, interval, pair["wins"].get<std::size_t>(), pair["ties"].get<std::size_t>(),
      pair["losses"].get<std::size_t>(), p_of(pair["p_holm"]));
}

void print_comparison(const Json& result) {
  for (const Json& one : result["comparisons"])
    for (const Json& pair : one["pairs"]) fmt::print("{}\n", pair["sentence"].get<std::string>());
  for (const Json& one : result["comparisons"]) {
    fmt::print("\n{}{}: {} blocks", one["metric"].get<std::string>(), where(one["at"]), one["blocks"].get<Index>());
    if (one.contains("friedman"))
      fmt::print(", Friedman chi2 {:.4g}, p {:.2g}, ranks differ beyond {:.3g}", one["friedman"]["chi2"].get<double>(),
                 one["friedman"]["p"].get<double>(), one["friedman"]["critical_difference"].get<double>());
    fmt::print("\n");
    std::size_t width = 6;
    for (const Json& method : one["methods"]) width = std::max(width, method["label"].get<std::string>().size());
    fmt::print("  {:<{}}  {:>12}  {:>9}  {:>6}\n", "method", width, "median", "mean rank", "failed");
    for (const Json& method : one["methods"])
      fmt::print("  {:<{}}  {:>12}  {:>9}  {:>6}\n", method["label"].get<std::string>(), width,
                 text_of(method["median"]), method.contains("mean_rank") ? text_of(method["mean_rank"]) : "-",
                 method["failed"].get<std::size_t>());
  }
}

}  // namespace wheelhop
