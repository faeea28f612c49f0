/// \file
/// `wheelhop compare`: paired statistics of the rows of a sweep.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "experiments/compare/pairing.hpp"

namespace wheelhop {

/// Pairs are rows of one realisation whose cells differ on the axis `over` alone. A row without a value of the metric
/// counts as worse than any value; two such are a tie. One realisation is one observation, whatever the number of its
/// pooled cells (differences(), blocks_by_realisation()); the performance profile alone counts every cell.
/// @return `{"over", "by", "alpha": 0.05, "level": 0.95, "comparisons": [{"metric", "better", "at": {AXIS: value},
/// "equivalence", "blocks", "incomplete_blocks", "methods": [{"label", "n", "failed", "median", "mean_rank"}],
/// "friedman": {"chi2", "p", "f", "p_f", "critical_difference"}, "pairs": [{"a", "b", "n", "median_difference", "ci95",
/// "wins", "ties", "losses", "both_failed", "p", "p_holm", "rank_biserial", "verdict", "sentence"}],
/// "profile": {"tau": [...], "share": {LABEL: [...]}}}]}`. Positive differences: `a` is better. p: Wilcoxon's
/// signed-rank test with Pratt's zeros; p_holm over all pairs of all comparisons. Blocks, n, wins, ties and losses
/// count realisations; the n and failed of a method and both_failed count rows. The verdict is better, equivalent,
/// undecided or too_few (verdict_of()). UserError for an axis or metric that is not there or has no better direction.
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
