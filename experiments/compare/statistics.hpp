/// \file
/// Statistics of paired comparisons: of methods on the same data sets. All are functions of numbers, without state.
///
/// Sources: Wilcoxon 1945 and Pratt 1959 (signed ranks, zeros); Holm 1979 (many tests); Kerby 2014 (rank-biserial
/// correlation); Friedman 1937, Iman & Davenport 1980, Nemenyi 1963 as Demsar 2006 uses them; Dolan & More 2002
/// (performance profiles); Efron & Tibshirani 1993 (percentile bootstrap); Robbins 1970 and Ramdas, Grunwald, Vovk &
/// Shafer 2023 (mixtures as e-processes).
#pragma once

#include <vector>

#include "core/base/linalg.hpp"

namespace wheelhop {

/// Ranks 1..n of values in ascending order, ties share the mean of their ranks.
std::vector<double> mid_ranks(const std::vector<double>& values);

enum class Zeros { drop, pratt };  ///< pratt: zeros are ranked with the rest, then their ranks are left out

struct SignedRank {
  double positive = 0, negative = 0;  ///< sums of the ranks of |d| where d > 0, d < 0
  double p = 1;                       ///< two-sided
  bool exact = true;                  ///< from all sign patterns of these ranks, ties included; else normal
};

/// Wilcoxon's signed-rank test of differences that are symmetric about 0. Infinite differences have the largest ranks.
/// @param exact_up_to exact p (by counting sign patterns, cost O(n^3)) up to so many differences; beyond that normal
/// with the variance of the ranks at hand and a continuity correction of half a rank
SignedRank wilcoxon_signed_rank(const std::vector<double>& differences, Zeros zeros, std::size_t exact_up_to = 200);

/// Matched-pairs rank-biserial correlation (R+ - R-) / (R+ + R-) in [-1, 1]; 0 without a difference.
double rank_biserial(const SignedRank& test);

/// Holm's step-down adjusted p-values, in the order given.
std::vector<double> holm(const std::vector<double>& p);

struct Friedman {
  Vector mean_ranks;  ///< k, 1 is best (smallest value)
  double chi2 = 0;    ///< k - 1 degrees of freedom, corrected for ties
  double p = 1;
  double f = 0, p_f = 1;  ///< Iman & Davenport's, k - 1 and (k - 1)(n - 1) degrees of freedom
};

/// @param values n data sets x k methods, smaller is better; n >= 2, k >= 2
Friedman friedman(ConstMatrixRef values);

/// Upper quantile of the studentized range of k normal variables of known variance, over sqrt(2): q_alpha of Nemenyi's
/// test. k >= 2, 0 < alpha < 1.
double nemenyi_quantile(Index k, double alpha);

/// Difference of mean ranks beyond which two of k methods differ over n data sets: q_alpha sqrt(k (k + 1) / (6 n)).
double critical_difference(Index k, Index n, double alpha);

struct Interval {
  double low = 0, high = 0;
};

double median(std::vector<double> values);

/// Percentile bootstrap interval of the median, for infinitely many resamples: the k-th of n values in ascending order
/// is at or above the median of a resample with probability P(Bin(n, k/n) >= m), m = (n + 1)/2 (Efron & Tibshirani
/// 1993, ch. 13, without their random numbers). For even n its lower end is that of the lower middle value, its upper
/// end that of the upper one. It lies within the range of the values, which holds the median of a continuous
/// distribution with probability coverage_of_range(n) only. @param level 0.95: from the 2.5 % to the 97.5 % quantile
Interval bootstrap_median(std::vector<double> values, double level);

/// Probability that the range of n independent values holds the median of their continuous distribution: 1 - 2^(1-n).
/// It reaches 0.95 from six values on.
double coverage_of_range(Index n);

/// Share of data sets on which a method needs at most tau times the least that any method needs.
/// @param ratios of one method; infinity where it failed
double performance_profile(const std::vector<double>& ratios, double tau);

/// Evidence against P(success) <= 1/2 after k successes in n trials: the likelihood ratio of success probabilities
/// uniform on (1/2, 1) to 1/2,  E = 2^(n+1) int_(1/2)^1 t^k (1-t)^(n-k) dt.  Whenever P(success) <= 1/2, the chance
/// that E ever reaches 1/alpha is at most alpha, however often one looks (Ville 1939). @return log E
double log_e_value(Index successes, Index trials);

/// What holds in more than half of all pairs of two methods: a is better by more than the equivalence, b is, or
/// neither.
enum class Claim { none, a_better, b_better, equivalent };

/// A claim about a pair of methods that differences decide one after the other. Wrong with a chance of at most
/// 3 exp(-log_threshold), however long one goes on: each of the three claims has its own e-value.
class SequentialClaim {
 public:
  /// @param log_threshold a claim is made when its log e-value reaches this
  SequentialClaim(double equivalence, double log_threshold)
      : equivalence_(equivalence), log_threshold_(log_threshold) {}

  /// @param difference positive: a is better. Nothing changes once a claim is made.
  void add(double difference);
  Claim claim() const { return claim_; }
  Index trials() const { return trials_; }  ///< differences until the claim was made, or so far

 private:
  double equivalence_, log_threshold_;
  Claim claim_ = Claim::none;
  Index trials_ = 0;
  Index holds_[3] = {0, 0, 0};
};

}  // namespace wheelhop
