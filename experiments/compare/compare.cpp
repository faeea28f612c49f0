#include "experiments/compare/compare.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/files.hpp"
#include "core/base/status.hpp"
#include "experiments/compare/print.hpp"
#include "experiments/compare/statistics.hpp"
#include "experiments/sweep/table.hpp"

namespace wheelhop {
namespace {

constexpr double kAlpha = 0.05, kLevel = 0.95;  // the field's custom
constexpr double kVafPoints = 0.1;              // equivalence that a user sets; the default of a VAF in percent
constexpr std::size_t kMostUsualPairs = 2000;   // of a table; about ten seconds

/// Values of a metric at one combination of the axes looked at: one row a block, one column a method. NaN: no such row.
struct Comparison {
  std::string metric;
  Better way = Better::larger;
  Json at = Json::object();
  std::map<std::pair<Index, std::vector<std::size_t>>, std::vector<double>> blocks;  // by realisation, pooled axes
};

struct Axes {
  std::size_t over;
  std::vector<std::size_t> by, pooled;
};

Axes read_axes_of(const Grid& grid, const CompareOptions& options) {
  std::vector<std::string> names;
  for (const Axis& axis : grid.axes) names.push_back(axis.name);
  const auto find = [&](const std::string& name, const char* option) {
    const Index at = grid.axis_called(name);
    if (at < 0) throw UserError(fmt::format("{}: no axis is called \"{}\"; axes: {}", option, name, join_names(names)));
    return static_cast<std::size_t>(at);
  };
  Axes axes{find(options.over, "--over"), {}, {}};
  for (const std::string& name : options.by) {
    axes.by.push_back(find(name, "--by"));
    if (axes.by.back() == axes.over) throw UserError("--by: \"" + name + "\" is the axis that is compared");
  }
  for (std::size_t i = 0; i < grid.axes.size(); ++i)
    if (i != axes.over && std::find(axes.by.begin(), axes.by.end(), i) == axes.by.end()) axes.pooled.push_back(i);
  if (grid.axes[axes.over].labels.size() < 2)
    throw UserError(fmt::format("--over: the axis \"{}\" has one value, nothing is to compare", options.over));
  return axes;
}

/// Columns asked for, or those that the measure is read by and that have a better direction.
std::vector<std::string> metrics_of(const Grid& grid, const RowIndex& rows, const CompareOptions& options) {
  std::vector<std::string> known;
  rows.for_each([&](const RowKey& key, const std::string& line) {
    if (key.realisation > 0) return;  // every row of a cell has the columns of its first, unless it failed
    const Json row = parse_json(line, "row");
    for (const auto& [column, value] : row.items())
      if (better(column) != Better::neither && std::find(known.begin(), known.end(), column) == known.end())
        known.push_back(column);
  });
  std::vector<std::string> metrics;
  for (const std::string& wanted : options.metrics) {
    if (std::find(known.begin(), known.end(), wanted) == known.end())
      throw UserError(
          fmt::format("--metric: \"{}\" is no column with a better direction; those: {}", wanted, join_names(known)));
    metrics.push_back(wanted);
  }
  if (metrics.empty())
    std::copy_if(known.begin(), known.end(), std::back_inserter(metrics),
                 [&](const std::string& column) { return is_headline(grid.measure, column); });
  if (metrics.empty()) throw UserError("no row has a value to compare");
  return metrics;
}

std::vector<Comparison> load(const Grid& grid, const RowIndex& rows, const Axes& axes,
                             const std::vector<std::string>& metrics, Index realisations) {
  std::map<std::vector<std::size_t>, std::vector<Comparison>> by_context;
  rows.for_each([&](const RowKey& key, const std::string& line) {
    if (key.realisation >= realisations) return;
    const Cell& cell = grid.cells[key.cell];
    std::vector<std::size_t> context, block;
    for (const std::size_t axis : axes.by) context.push_back(cell.at[axis]);
    for (const std::size_t axis : axes.pooled) block.push_back(cell.at[axis]);
    std::vector<Comparison>& own = by_context[context];
    if (own.empty())
      for (const std::string& metric : metrics) {
        own.push_back({metric, better(metric), Json::object(), {}});
        for (const std::size_t axis : axes.by) own.back().at[grid.axes[axis].name] = grid.value(key.cell, axis);
      }
    const Json row = parse_json(line, "row");
    for (Comparison& one : own) {
      std::vector<double>& values = one.blocks[{key.realisation, block}];
      values.resize(grid.axes[axes.over].labels.size(), std::numeric_limits<double>::quiet_NaN());
      const bool has = row.contains(one.metric) && row[one.metric].is_number();
      values[cell.at[axes.over]] = has ? row[one.metric].get<double>() : worst(one.way);
    }
  });
  std::vector<Comparison> all;
  for (auto& [context, own] : by_context) std::move(own.begin(), own.end(), std::back_inserter(all));
  return all;
}

double equivalence_of(const Comparison& comparison, const std::optional<double>& given) {
  if (given) return *given;
  return comparison.metric.find("_vaf_") != std::string::npos ? kVafPoints : 0;
}

/// By how much a is better than b; 0 where both failed.
double advantage(const Comparison& comparison, double a, double b) {
  if (a == b) return 0;
  return comparison.way == Better::larger ? a - b : b - a;
}

std::vector<double> present(const Comparison& comparison, std::size_t method) {
  std::vector<double> values;
  for (const auto& [block, row] : comparison.blocks)
    if (!std::isnan(row[method])) values.push_back(row[method]);
  return values;
}

Json methods_json(const Comparison& comparison, const std::vector<std::string>& labels) {
  Json list = Json::array();
  for (std::size_t j = 0; j < labels.size(); ++j) {
    const std::vector<double> values = present(comparison, j);
    const auto failed = std::count_if(values.begin(), values.end(), [](double v) { return std::isinf(v); });
    list.push_back({{"label", labels[j]},
                    {"n", values.size()},
                    {"failed", failed},
                    {"median", values.empty() ? Json() : Json(median(values))}});
  }
  return list;
}

/// n x k, smaller is better, of the blocks in which every method has a row.
Matrix complete_blocks(const Comparison& comparison, std::size_t methods) {
  std::vector<const std::vector<double>*> complete;
  for (const auto& [block, row] : comparison.blocks)
    if (std::none_of(row.begin(), row.end(), [](double v) { return std::isnan(v); })) complete.push_back(&row);
  Matrix values(static_cast<Index>(complete.size()), static_cast<Index>(methods));
  for (Index i = 0; i < values.rows(); ++i)
    for (Index j = 0; j < values.cols(); ++j) {
      const double v = (*complete[static_cast<std::size_t>(i)])[static_cast<std::size_t>(j)];
      values(i, j) = comparison.way == Better::larger ? -v : v;
    }
  return values;
}

/// Dolan and More's profile of what a method leaves: 100 - VAF, 1 - R^2, RMSE or cost. Null where any of it is below 0.
Json profile_json(const Comparison& comparison, const Matrix& blocks, const std::vector<std::string>& labels) {
  static const std::vector<double> taus = {1, 1.05, 1.1, 1.2, 1.5, 2, 3, 5, 10, 20, 50, 100, 1000};
  const double perfect = comparison.metric.find("_vaf_") != std::string::npos ? 100
                         : comparison.way == Better::larger                   ? 1
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

/// Differences of a pair, and their counts.
Json pair_json(const Comparison& comparison, const std::vector<std::string>& labels, std::size_t a, std::size_t b,
               double equivalence) {
  std::vector<double> differences;
  Index both_failed = 0;
  for (const auto& [block, row] : comparison.blocks) {
    if (std::isnan(row[a]) || std::isnan(row[b])) continue;
    differences.push_back(advantage(comparison, row[a], row[b]));
    both_failed += std::isinf(row[a]) && std::isinf(row[b]);
  }
  if (differences.empty()) return {};
  double middle = median(differences);
  if (middle < 0) {  // the better one first
    std::swap(a, b);
    for (double& d : differences) d = -d;
    middle = -middle;
  }
  const auto count = [&](auto&& fits) { return std::count_if(differences.begin(), differences.end(), fits); };
  const SignedRank test = wilcoxon_signed_rank(differences, Zeros::pratt);
  const Interval interval = bootstrap_median(differences, kLevel);
  return {{"a", labels[a]},
          {"b", labels[b]},
          {"n", differences.size()},
          {"median_difference", middle},
          {"ci95", {interval.low, interval.high}},
          {"wins", count([&](double d) { return d > equivalence; })},
          {"ties", count([&](double d) { return std::abs(d) <= equivalence; })},
          {"losses", count([&](double d) { return d < -equivalence; })},
          {"both_failed", both_failed},
          {"p", test.p},
          {"rank_biserial", rank_biserial(test)}};
}

/// What a pair's numbers say: better, equivalent (the interval lies within the equivalence) or undecided.
std::string verdict_of(const Json& pair, double equivalence) {
  const auto end = [&](int i) { return pair["ci95"][static_cast<std::size_t>(i)].get<double>(); };
  if (pair["p_holm"].get<double>() < kAlpha && end(0) > equivalence) return "better";
  if (end(0) >= -equivalence && end(1) <= equivalence) return "equivalent";
  return "undecided";
}

}  // namespace

Json compare_rows(const Grid& grid, const RowIndex& rows, const CompareOptions& options) {
  const Axes axes = read_axes_of(grid, options);
  const std::vector<std::string> metrics = metrics_of(grid, rows, options);
  const std::vector<std::string>& labels = grid.axes[axes.over].labels;
  const auto k = static_cast<Index>(labels.size());
  Json comparisons = Json::array();
  std::vector<double> p;
  for (const Comparison& one : load(grid, rows, axes, metrics, std::numeric_limits<Index>::max())) {
    const double equivalence = equivalence_of(one, options.equivalence);
    const Matrix blocks = complete_blocks(one, labels.size());
    Json out = {{"metric", one.metric},
                {"better", one.way == Better::larger ? "larger" : "smaller"},
                {"at", one.at},
                {"equivalence", equivalence},
                {"blocks", blocks.rows()},
                {"incomplete_blocks", static_cast<Index>(one.blocks.size()) - blocks.rows()},
                {"methods", methods_json(one, labels)}};
    if (blocks.rows() >= 2) {
      const Friedman ranks = friedman(blocks);
      for (std::size_t j = 0; j < labels.size(); ++j)
        out["methods"][j]["mean_rank"] = ranks.mean_ranks(static_cast<Index>(j));
      out["friedman"] = {{"chi2", ranks.chi2},
                         {"p", ranks.p},
                         {"f", ranks.f},
                         {"p_f", ranks.p_f},
                         {"critical_difference", critical_difference(k, blocks.rows(), kAlpha)}};
    }
    out["pairs"] = Json::array();
    for (std::size_t a = 0; a < labels.size(); ++a)
      for (std::size_t b = a + 1; b < labels.size(); ++b)
        if (Json pair = pair_json(one, labels, a, b, equivalence); !pair.is_null()) {
          p.push_back(pair["p"].get<double>());
          out["pairs"].push_back(std::move(pair));
        }
    out["profile"] = profile_json(one, blocks, labels);
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
  for (const Axis& axis : grid.axes)
    if (axis.name != options.over && axis.labels.size() > 1) options.by.push_back(axis.name);
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
  const Axes axes = read_axes_of(grid, options);
  const std::vector<std::string>& labels = grid.axes[axes.over].labels;
  const std::vector<Comparison> all = load(grid, rows, axes, metrics_of(grid, rows, options), realisations);
  const double claims = 3 * static_cast<double>(all.size() * labels.size() * (labels.size() - 1) / 2);
  const double enough = std::log(claims / kAlpha);
  Json list = Json::array();
  for (const Comparison& one : all)
    for (std::size_t a = 0; a < labels.size(); ++a)
      for (std::size_t b = a + 1; b < labels.size(); ++b) {
        const double equivalence = equivalence_of(one, options.equivalence);
        static constexpr const char* names[] = {"", "a_better", "b_better", "equivalent"};
        Json entry = {{"metric", one.metric}, {"at", one.at}, {"a", labels[a]}, {"b", labels[b]}, {"claim", nullptr}};
        SequentialClaim claim(equivalence, enough);
        for (const auto& [block, row] : one.blocks) {
          if (std::isnan(row[a]) || std::isnan(row[b])) continue;
          claim.add(advantage(one, row[a], row[b]));
          if (claim.claim() == Claim::none) continue;
          entry["claim"] = names[static_cast<int>(claim.claim())];
          entry["after"] = block.first + 1;
          break;
        }
        list.push_back(std::move(entry));
      }
  return list;
}

int run_compare(const CompareRequest& request) {
  const std::filesystem::path file = request.folder / "sweep.json";
  const Json own = parse_json(read_file(file), file.string());
  if (!own.contains("config")) throw UserError(file.string() + ": expected the file that `wheelhop sweep` writes");
  const Grid grid = read_grid(own.at("config"), file.string());
  const RowIndex rows(request.folder, [&](const Json& row) {
    const auto cell = row["cell"].get<std::size_t>();
    return cell < grid.cells.size() &&
           row.value("config_hash", "") == row_hash(grid, cell, row["realisation"].get<Index>());
  });
  if (rows.size() == 0) throw UserError(request.folder.string() + ": expected rows of a sweep, found none");
  Json result = {{"schema", "wheelhop.compare/1"}};
  result.update(compare_rows(grid, rows, request.options));
  result["provenance"] = own.at("provenance");
  const std::filesystem::path out = request.out.empty() ? request.folder / "compare.json" : request.out;
  write_json(out, result);
  print_comparison(result);
  fmt::print("\nwritten: {}\n", out.string());
  return 0;
}

}  // namespace wheelhop
