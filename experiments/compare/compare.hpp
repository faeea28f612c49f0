/// \file
/// `wheelhop compare`: paired statistics of the rows of a sweep.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "experiments/run/rows.hpp"
#include "experiments/sweep/grid.hpp"

namespace wheelhop {

struct CompareOptions {
  std::string over;                   ///< axis whose values are compared
  std::vector<std::string> by;        ///< axes that are looked at value by value; the remaining ones are pooled
  std::vector<std::string> metrics;   ///< columns; empty: those the sweep's measure is read by
  std::optional<double> equivalence;  ///< differences up to this are ties; none: 0.1 for a VAF in percent, 0 for others
};

/// Pairs are rows of one realisation whose cells differ on the axis `over` alone. A row without a value of the metric
/// counts as worse than any value; two such are a tie.
/// @return `{"over", "by", "alpha": 0.05, "level": 0.95, "comparisons": [{"metric", "better", "at": {AXIS: value},
/// "equivalence", "blocks", "incomplete_blocks", "methods": [{"label", "median", "mean_rank", "failed"}],
/// "friedman": {"chi2", "p", "f", "p_f", "critical_difference"}, "pairs": [{"a", "b", "n", "median_difference", "ci95",
/// "wins", "ties", "losses", "both_failed", "p", "p_holm", "rank_biserial", "verdict", "sentence"}],
/// "profile": {"tau": [...], "share": {LABEL: [...]}}}]}`. Positive differences: `a` is better. p: Wilcoxon's
/// signed-rank test with Pratt's zeros; p_holm over all pairs of all comparisons. Mean ranks, Friedman's test and the
/// profile stand on complete blocks, pairs on all rows that both methods have. UserError for an axis or metric that is
/// not there or has no better direction.
Json compare_rows(const Grid& grid, const RowIndex& rows, const CompareOptions& options);

/// The comparison that goes into table.json: over the axis of `until`, or the last with more than one value, by all
/// others that vary. Null where there is none, or more pairs than a table should wait for.
Json usual_comparison(const Grid& grid, const RowIndex& rows);

/// What the first `realisations` decide of the paired claims along the axis of `until`: for each pair, metric and
/// combination of the other axes, whether `a_better`, `b_better` (by more than the equivalence) or `equivalent` holds
/// in more than half of the pairs. Decided is what an e-value (log_e_value) of at least 3 K / 0.05 after any
/// realisation says, for K comparisons of three claims each: the chance of any wrong claim, however often one looks, is
/// at most 5 %.
/// @return array of `{"metric", "at", "a", "b", "claim": ... or null, "after": realisations}`
Json decided_claims(const Grid& grid, const RowIndex& rows, Index realisations);

struct CompareRequest {
  std::filesystem::path folder;  ///< of a sweep
  std::filesystem::path out;     ///< empty: compare.json in the folder
  CompareOptions options;
};

/// Writes compare.json and prints a sentence a pair and a table. @return 0
int run_compare(const CompareRequest& request);

}  // namespace wheelhop
