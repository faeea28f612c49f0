#include "experiments/compare/compare.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/files.hpp"
#include "core/base/status.hpp"
#include "experiments/compare/print.hpp"
#include "experiments/compare/statistics.hpp"
#include "experiments/run/file_uses.hpp"
#include "experiments/sweep/folder.hpp"

namespace wheelhop {
namespace {

constexpr double kAlpha = 0.05, kLevel = 0.95;  // the field's custom
constexpr double kVafPoints = 0.1;              // equivalence that a user sets; the default of a VAF in percent
constexpr std::size_t kMostUsualPairs = 2000;   // of a table; about ten seconds

double equivalence_of(const Pairing& pairing, const std::optional<double>& given) {
  if (given) return *given;
  return pairing.metric.find("_vaf_") != std::string::npos ? kVafPoints : 0;
}

Json methods_json(const Pairing& pairing, const std::vector<std::string>& labels) {
  Json list = Json::array();
  for (std::size_t j = 0; j < labels.size(); ++j) {
    std::vector<double> values;
    for (const auto& [realisation, cells] : pairing.values)
      for (const auto& [cell, row] : cells)
        if (!std::isnan(row[j])) values.push_back(row[j]);
    const auto failed = std::count_if(values.begin(), values.end(), [](double v) { return std::isinf(v); });
    list.push_back({{"label", labels[j]},
                    {"n", values.size()},
                    {"failed", failed},
                    {"median", values.empty() ? Json() : Json(median(values))}});
  }
  return list;
}

/// Dolan and More's profile of what a method leaves: 100 - VAF, 1 - R^2, RMSE or cost. Null where any of it is below 0.
Json profile_json(const Pairing& pairing, const Matrix& blocks, const std::vector<std::string>& labels) {
  static const std::vector<double> taus = {1, 1.05, 1.1, 1.2, 1.5, 2, 3, 5, 10, 20, 50, 100, 1000};
  const double perfect = pairing.metric.find("_vaf_") != std::string::npos ? 100
                         : pairing.way == Better::larger                   ? 1
                                                                           : 0;
  const Matrix left = blocks.array() + perfect;
  if (left.size() == 0 || left.minCoeff() < 0) return {};
  Json out = {{"tau", taus}, {"share", Json::object()}};
  for (std::size_t j = 0; j < labels.size(); ++j) {
    std::vector<double> ratios, shares;
    for (Index i = 0; i < left.rows(); ++i) {
      const double least = left.row(i).minCoeff(), own = left(i, static_cast<Index>(j));
      ratios.push_back(std::isinf(own) ? own
                       : own == least  ? 1
                       : least > 0     ? own / least
                                       : std::numeric_limits<double>::infinity());
    }
    for (const double tau : taus) shares.push_back(performance_profile(ratios, tau));
    out["share"][labels[j]] = shares;
  }
  return out;
}

/// Rows of a pair, by realisation and pooled cell, in which both have no value.
Index both_failed(const Pairing& pairing, std::size_t a, std::size_t b) {
  Index count = 0;
  for (const auto& [realisation, cells] : pairing.values)
    for (const auto& [cell, row] : cells) count += std::isinf(row[a]) && std::isinf(row[b]);
  return count;
}

/// Differences of a pair, and their counts. Null where no realisation has both.
Json pair_json(const Pairing& pairing, const std::vector<std::string>& labels, std::size_t a, std::size_t b,
               double equivalence) {
  std::vector<double> values;
  for (const Difference& one : differences(pairing, a, b)) values.push_back(one.value);
  if (values.empty()) return {};
  double middle = median(values);
  if (middle < 0) {  // the better one first
    std::swap(a, b);
    for (double& d : values) d = -d;
    middle = -middle;
  }
  const auto count = [&](auto&& fits) { return std::count_if(values.begin(), values.end(), fits); };
  const SignedRank test = wilcoxon_signed_rank(values, Zeros::pratt);
  const Interval interval = bootstrap_median(values, kLevel);
  return {{"a", labels[a]},
          {"b", labels[b]},
          {"n", values.size()},
          {"median_difference", middle},
          {"ci95", {interval.low, interval.high}},
          {"wins", count([&](double d) { return d > equivalence; })},
          {"ties", count([&](double d) { return std::abs(d) <= equivalence; })},
          {"losses", count([&](double d) { return d < -equivalence; })},
          {"both_failed", both_failed(pairing, a, b)},
          {"p", test.p},
          {"rank_biserial", rank_biserial(test)}};
}

/// What a pair's numbers say: better, equivalent (the interval lies within the equivalence), undecided, or too_few
/// where not even the range of all differences holds the median with the interval's level.
std::string verdict_of(const Json& pair, double equivalence) {
  const auto end = [&](int i) { return pair["ci95"][static_cast<std::size_t>(i)].get<double>(); };
  if (coverage_of_range(pair["n"].get<Index>()) < kLevel) return "too_few";
  if (pair["p_holm"].get<double>() < kAlpha && end(0) > equivalence) return "better";
  if (end(0) >= -equivalence && end(1) <= equivalence) return "equivalent";
  return "undecided";
}

}  // namespace

Json compare_rows(const Grid& grid, const RowIndex& rows, const CompareOptions& options) {
  const PairedAxes axes = paired_axes(grid, options);
  const std::vector<std::string> metrics = metrics_of(grid, rows, options);
  if (metrics.empty()) throw UserError("no row has a value to compare");
  const std::vector<std::string>& labels = grid.axes[axes.over].labels;
  const auto k = static_cast<Index>(labels.size());
  // It goes with one over the root of the number of blocks; its integral is worth computing once.
  const double difference_of_one_block = critical_difference(k, 1, kAlpha);
  Json comparisons = Json::array();
  std::vector<double> p;
  for (const Pairing& one : pair_rows(grid, rows, axes, metrics)) {
    const double equivalence = equivalence_of(one, options.equivalence);
    const Matrix blocks = blocks_by_realisation(one, labels.size());
    Json out = {{"metric", one.metric},
                {"better", one.way == Better::larger ? "larger" : "smaller"},
                {"at", one.at},
                {"equivalence", equivalence},
                {"blocks", blocks.rows()},
                {"incomplete_blocks", static_cast<Index>(one.values.size()) - blocks.rows()},
                {"methods", methods_json(one, labels)}};
    if (blocks.rows() >= 2) {
      const Friedman ranks = friedman(blocks);
      for (std::size_t j = 0; j < labels.size(); ++j)
        out["methods"][j]["mean_rank"] = ranks.mean_ranks(static_cast<Index>(j));
      out["friedman"] = {
          {"chi2", ranks.chi2},
          {"p", ranks.p},
          {"f", ranks.f},
          {"p_f", ranks.p_f},
          {"critical_difference", difference_of_one_block / std::sqrt(static_cast<double>(blocks.rows()))}};
    }
    out["pairs"] = Json::array();
    for (std::size_t a = 0; a < labels.size(); ++a)
      for (std::size_t b = a + 1; b < labels.size(); ++b)
        if (Json pair = pair_json(one, labels, a, b, equivalence); !pair.is_null()) {
          p.push_back(pair["p"].get<double>());
          out["pairs"].push_back(std::move(pair));
        }
    out["profile"] = profile_json(one, blocks_by_cell(one, labels.size()), labels);
    comparisons.push_back(std::move(out));
  }
  const std::vector<double> adjusted = holm(p);
  std::size_t number = 0;
  for (Json& one : comparisons)
    for (Json& pair : one["pairs"]) {
      pair["p_holm"] = adjusted[number++];
      pair["verdict"] = verdict_of(pair, one["equivalence"].get<double>());
      pair["sentence"] = sentence_of(one, pair);
    }
  return {{"over", options.over},
          {"by", options.by},
          {"alpha", kAlpha},
          {"level", kLevel},
          {"comparisons", std::move(comparisons)}};
}

namespace {

CompareOptions usual_options(const Grid& grid) {
  CompareOptions options;
  if (grid.until) {
    options.over = grid.until->over;
    options.equivalence = grid.until->equivalence;
  }
  for (const Axis& axis : grid.axes)
    if (!grid.until && axis.labels.size() > 1) options.over = axis.name;
  const Index over = grid.axis_called(options.over);
  for (std::size_t i = 0; over >= 0 && i < grid.axes.size(); ++i)
    if (!grid.vary_together(i, static_cast<std::size_t>(over)) && grid.axes[i].labels.size() > 1)
      options.by.push_back(grid.axes[i].name);
  return options;
}

}  // namespace

Json usual_comparison(const Grid& grid, const RowIndex& rows) {
  const CompareOptions options = usual_options(grid);
  if (options.over.empty()) return {};
  const std::size_t k = grid.axes[static_cast<std::size_t>(grid.axis_called(options.over))].labels.size();
  if (k < 2 || grid.cells.size() * (k - 1) / 2 > kMostUsualPairs) return {};
  try {
    return compare_rows(grid, rows, options);
  } catch (const UserError&) {  // no row has a value
    return {};
  }
}

Json decided_claims(const Grid& grid, const RowIndex& rows, Index realisations) {
  const CompareOptions options = usual_options(grid);
  const PairedAxes axes = paired_axes(grid, options);
  const std::vector<std::string>& labels = grid.axes[axes.over].labels;
  const std::vector<Pairing> all =
      pair_rows(grid, rows, axes, metrics_of(grid, rows, options, realisations), realisations);
  const double claims = 3 * static_cast<double>(all.size() * labels.size() * (labels.size() - 1) / 2);
  const double enough = std::log(claims / kAlpha);
  Json list = Json::array();
  for (const Pairing& one : all)
    for (std::size_t a = 0; a < labels.size(); ++a)
      for (std::size_t b = a + 1; b < labels.size(); ++b) {
        const double equivalence = equivalence_of(one, options.equivalence);
        static constexpr const char* names[] = {"", "a_better", "b_better", "equivalent"};
        Json entry = {{"metric", one.metric}, {"at", one.at}, {"a", labels[a]}, {"b", labels[b]}, {"claim", nullptr}};
        SequentialClaim claim(equivalence, enough);
        for (const Difference& difference : differences(one, a, b)) {
          claim.add(difference.value);
          if (claim.claim() == Claim::none) continue;
          entry["claim"] = names[static_cast<int>(claim.claim())];
          entry["after"] = difference.realisation + 1;
          break;
        }
        list.push_back(std::move(entry));
      }
  return list;
}

int run_compare(const CompareRequest& request) {
  const SweepFolder folder = read_folder(request.folder);
  const std::filesystem::path out = request.out.empty() ? request.folder / "compare.json" : request.out;
  FileUses uses;
  uses.reads("the sweep in DIR", request.folder / "sweep.json").writes("--out", out);
  for (const std::filesystem::path& rows : row_files(request.folder, "rows")) uses.reads("the rows in DIR", rows);
  uses.check();
  const FileLock still = hold_rows(request.folder);
  const RowIndex rows(request.folder, [&](const Json& row) { return is_row_of(folder.grid, row); });
  if (rows.size() == 0) throw UserError(request.folder.string() + ": expected rows of a sweep, found none");
  Json result = {{"schema", "wheelhop.compare/1"}};
  result.update(compare_rows(folder.grid, rows, request.options));
  result["provenance"] = folder.provenance;
  write_json(out, result);
  print_comparison(result);
  fmt::print("\nwritten: {}\n", out.string());
  return 0;
}

}  // namespace wheelhop
