#include "experiments/compare/statistics.hpp"

#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/fisher_f.hpp>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/quadrature/gauss_kronrod.hpp>
#include <boost/math/special_functions/beta.hpp>
#include <boost/math/tools/toms748_solve.hpp>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "experiments/run/statistics.hpp"

namespace wheelhop {
namespace {

double normal_tail(double z) { return boost::math::cdf(boost::math::complement(boost::math::normal(), z)); }

/// P(W <= w or W >= total - w) for w <= total / 2, where W sums the ranks of random signs. @param doubled ranks, whole
double exact_two_sided(const std::vector<Index>& doubled, Index smaller) {
  const Index total = std::accumulate(doubled.begin(), doubled.end(), Index{0});
  std::vector<double> chance(static_cast<std::size_t>(total) + 1, 0.0);  // of each sum
  chance[0] = 1;
  Index reached = 0;
  for (const Index rank : doubled) {
    for (Index sum = reached + rank; sum >= 0; --sum) {
      const double without = sum <= reached ? chance[static_cast<std::size_t>(sum)] : 0;
      const double with = sum >= rank ? chance[static_cast<std::size_t>(sum - rank)] : 0;
      chance[static_cast<std::size_t>(sum)] = 0.5 * (without + with);
    }
    reached += rank;
  }
  double below = 0;
  for (Index sum = 0; sum <= smaller; ++sum) below += chance[static_cast<std::size_t>(sum)];
  return std::min(1.0, 2 * below);
}

}  // namespace

std::vector<double> mid_ranks(const std::vector<double>& values) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return values[a] < values[b]; });
  std::vector<double> ranks(values.size());
  for (std::size_t first = 0, last; first < order.size(); first = last) {
    last = first + 1;
    while (last < order.size() && values[order[last]] == values[order[first]]) ++last;
    for (std::size_t i = first; i < last; ++i) ranks[order[i]] = 0.5 * static_cast<double>(first + 1 + last);
  }
  return ranks;
}

SignedRank wilcoxon_signed_rank(const std::vector<double>& differences, Zeros zeros, std::size_t exact_up_to) {
  std::vector<double> sizes, signs;
  for (const double d : differences) {
    if (zeros == Zeros::drop && d == 0) continue;
    sizes.push_back(std::abs(d));
    signs.push_back(d > 0 ? 1 : d < 0 ? -1 : 0);
  }
  const std::vector<double> ranks = mid_ranks(sizes);
  SignedRank test;
  std::vector<Index> doubled;
  double squares = 0;
  for (std::size_t i = 0; i < ranks.size(); ++i) {
    if (signs[i] == 0) continue;
    (signs[i] > 0 ? test.positive : test.negative) += ranks[i];
    doubled.push_back(std::llround(2 * ranks[i]));
    squares += ranks[i] * ranks[i];
  }
  if (doubled.empty()) return test;
  const double smaller = std::min(test.positive, test.negative);
  test.exact = doubled.size() <= exact_up_to;
  if (test.exact) {
    test.p = exact_two_sided(doubled, std::llround(2 * smaller));
  } else {
    const double mean = 0.5 * (test.positive + test.negative);
    test.p = std::min(1.0, 2 * normal_tail(std::max(0.0, mean - smaller - 0.5) / std::sqrt(squares / 4)));
  }
  return test;
}

double rank_biserial(const SignedRank& test) {
  const double total = test.positive + test.negative;
  return total > 0 ? (test.positive - test.negative) / total : 0;
}

std::vector<double> holm(const std::vector<double>& p) {
  std::vector<std::size_t> order(p.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return p[a] < p[b]; });
  std::vector<double> adjusted(p.size());
  double largest = 0;
  for (std::size_t i = 0; i < order.size(); ++i) {
    largest = std::max(largest, std::min(1.0, static_cast<double>(p.size() - i) * p[order[i]]));
    adjusted[order[i]] = largest;
  }
  return adjusted;
}

Friedman friedman(ConstMatrixRef values) {
  const Index n = values.rows(), k = values.cols();
  const double blocks = static_cast<double>(n), methods = static_cast<double>(k);
  Friedman test;
  test.mean_ranks = Vector::Zero(k);
  double ties = 0;
  for (Index i = 0; i < n; ++i) {
    const Vector row = values.row(i);
    std::vector<double> block(row.begin(), row.end());
    const std::vector<double> ranks = mid_ranks(block);
    for (Index j = 0; j < k; ++j) test.mean_ranks(j) += ranks[static_cast<std::size_t>(j)] / blocks;
    std::sort(block.begin(), block.end());
    for (std::size_t first = 0, last; first < block.size(); first = last) {
      last = first + 1;
      while (last < block.size() && block[last] == block[first]) ++last;
      const double t = static_cast<double>(last - first);
      ties += t * t * t - t;
    }
  }
  const double correction = 1 - ties / (blocks * (methods * methods * methods - methods));
  if (!(correction > 0)) return test;  // every block is one tie
  const double spread = (test.mean_ranks.array() - 0.5 * (methods + 1)).square().sum();
  test.chi2 = 12 * blocks / (methods * (methods + 1)) * spread / correction;
  test.p = boost::math::cdf(boost::math::complement(boost::math::chi_squared(methods - 1), test.chi2));
  const double left = blocks * (methods - 1) - test.chi2;
  if (left <= 1e-12 * blocks) {  // all blocks agree
    test.f = std::numeric_limits<double>::infinity();
    test.p_f = 0;
    return test;
  }
  test.f = (blocks - 1) * test.chi2 / left;
  test.p_f = boost::math::cdf(
      boost::math::complement(boost::math::fisher_f(methods - 1, (methods - 1) * (blocks - 1)), test.f));
  return test;
}

double nemenyi_quantile(Index k, double alpha) {
  const boost::math::normal normal;
  // P(range <= q) = k int phi(z) [Phi(z) - Phi(z - q)]^(k-1) dz
  const auto below = [&](double q) {
    const auto density = [&](double z) {
      return boost::math::pdf(normal, z) *
             std::pow(boost::math::cdf(normal, z) - boost::math::cdf(normal, z - q), static_cast<double>(k - 1));
    };
    return static_cast<double>(k) *
           boost::math::quadrature::gauss_kronrod<double, 61>::integrate(density, -8.5, 8.5 + q, 12, 1e-13);
  };
  std::uintmax_t steps = 200;
  const auto root = boost::math::tools::toms748_solve([&](double q) { return below(q) - (1 - alpha); }, 1e-9, 40.0,
                                                      boost::math::tools::eps_tolerance<double>(45), steps);
  return 0.5 * (root.first + root.second) / std::numbers::sqrt2;
}

double critical_difference(Index k, Index n, double alpha) {
  return nemenyi_quantile(k, alpha) * std::sqrt(static_cast<double>(k * (k + 1)) / (6 * static_cast<double>(n)));
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return quantile(values, 0.5);
}

Interval bootstrap_median(std::vector<double> values, double level) {
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  const double count = static_cast<double>(n);
  // The p-quantile of the m-th smallest value of a resample.
  const auto quantile_of = [&](std::size_t m, double p) {
    const double successes = static_cast<double>(m);
    for (std::size_t k = 1; k < n; ++k)
      if (boost::math::ibeta(successes, count - successes + 1, static_cast<double>(k) / count) >= p)
        return values[k - 1];
    return values[n - 1];
  };
  return {quantile_of((n + 1) / 2, 0.5 * (1 - level)), quantile_of(n / 2 + 1, 0.5 * (1 + level))};
}

double coverage_of_range(Index n) { return 1 - std::exp2(1 - static_cast<double>(n)); }

double performance_profile(const std::vector<double>& ratios, double tau) {
  const auto within = std::count_if(ratios.begin(), ratios.end(), [&](double r) { return r <= tau; });
  return static_cast<double>(within) / static_cast<double>(ratios.size());
}

double log_e_value(Index successes, Index trials) {
  const double a = static_cast<double>(successes) + 1, b = static_cast<double>(trials - successes) + 1;
  // int_(1/2)^1 t^(a-1) (1-t)^(b-1) dt = B(a, b) P(T > 1/2)
  const double tail = boost::math::ibetac(a, b, 0.5);
  const double log_beta = std::lgamma(a) + std::lgamma(b) - std::lgamma(a + b);
  return static_cast<double>(trials + 1) * std::numbers::ln2 + log_beta + std::log(tail);
}

void SequentialClaim::add(double difference) {
  if (claim_ != Claim::none) return;
  ++trials_;
  ++holds_[difference > equivalence_ ? 0 : difference < -equivalence_ ? 1 : 2];
  static constexpr Claim claims[] = {Claim::a_better, Claim::b_better, Claim::equivalent};
  for (std::size_t i = 0; i < 3; ++i)
    if (log_e_value(holds_[i], trials_) >= log_threshold_) claim_ = claims[i];
}

}  // namespace wheelhop
