// Statistics of paired comparisons against their definitions and published numbers.
#include "experiments/compare/statistics.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

using namespace wheelhop;

namespace {

Random numbers(std::uint64_t cell) { return Random(31, Stream::parameters, cell); }

}  // namespace

TEST_CASE("the signed-rank test counts sign patterns: exact p of all 2^n of them, with ties and zeros") {
  Random random = numbers(1);
  for (const Zeros zeros : {Zeros::drop, Zeros::pratt})
    for (int trial = 0; trial < 20; ++trial) {
      std::vector<double> d;
      for (int i = 0; i < 9; ++i) d.push_back(std::round(2 * random.normal() + 0.5));  // ties and zeros
      const SignedRank test = wilcoxon_signed_rank(d, zeros);
      if (test.positive + test.negative == 0) continue;
      // Every pattern of signs of the same sizes is as likely under the null.
      const double smaller = std::min(test.positive, test.negative);
      int as_extreme = 0, patterns = 0;
      for (int mask = 0; mask < 512; ++mask) {
        std::vector<double> flipped = d;
        for (int i = 0; i < 9; ++i) flipped[static_cast<std::size_t>(i)] *= (mask >> i & 1) ? -1 : 1;
        const SignedRank other = wilcoxon_signed_rank(flipped, zeros);
        as_extreme += other.negative <= smaller + 1e-9;
        ++patterns;
      }
      CHECK(test.p == Approx(std::min(1.0, 2.0 * as_extreme / patterns)).margin(1e-12));
    }
}

TEST_CASE("the normal approximation of the signed-rank test meets the exact one where it takes over") {
  Random random = numbers(2);
  std::vector<double> d;
  for (int i = 0; i < 200; ++i) d.push_back(random.normal() + 0.15);
  const SignedRank exact = wilcoxon_signed_rank(d, Zeros::pratt);
  CHECK(exact.exact);
  d.push_back(0.151);
  const SignedRank normal = wilcoxon_signed_rank(d, Zeros::pratt);
  CHECK_FALSE(normal.exact);
  CHECK(normal.p == Approx(exact.p).epsilon(0.15));
}

TEST_CASE("Holm's p-values are step-down Bonferroni's, in the order given") {
  CHECK(holm({0.01, 0.04, 0.03, 0.005}) == std::vector<double>{0.03, 0.06, 0.06, 0.02});
  CHECK(holm({}).empty());
  CHECK(holm({0.9, 0.8}) == std::vector<double>{1, 1});
}

TEST_CASE("Nemenyi's quantiles are those of Demsar 2006, Table 5(a)") {
  const double at_05[] = {1.960, 2.343, 2.569, 2.728, 2.850, 2.949, 3.031, 3.102, 3.164};
  const double at_10[] = {1.645, 2.052, 2.291, 2.459, 2.589, 2.693, 2.780, 2.855, 2.920};
  for (Index k = 2; k <= 10; ++k) {
    // The last printed digits of that table are off by up to two.
    CHECK(nemenyi_quantile(k, 0.05) == Approx(at_05[k - 2]).margin(2e-3));
    CHECK(nemenyi_quantile(k, 0.10) == Approx(at_10[k - 2]).margin(2e-3));
  }
  CHECK(critical_difference(4, 14, 0.05) == Approx(1.25).margin(0.005));
}

TEST_CASE("Friedman's ranks and statistic: equal methods share ranks, and a constant order gives the largest chi2") {
  Matrix values(5, 3);
  for (Index i = 0; i < 5; ++i) values.row(i) << 1, 2, 3;
  const Friedman constant = friedman(values);
  CHECK(constant.mean_ranks(0) == 1);
  CHECK(constant.mean_ranks(2) == 3);
  CHECK(constant.chi2 == Approx(5 * 2));  // n (k - 1)
  CHECK(constant.p_f == 0);
  values.setOnes();
  const Friedman ties = friedman(values);
  CHECK(ties.chi2 == 0);
  CHECK(ties.p == 1);
  CHECK(ties.mean_ranks(1) == 2);
}

TEST_CASE("the bootstrap interval of the median holds it at its level, and failures do not break it") {
  Random random = numbers(3);
  int holds = 0;
  for (int trial = 0; trial < 400; ++trial) {
    std::vector<double> values;
    for (int i = 0; i < 41; ++i) values.push_back(random.normal());
    const Interval interval = bootstrap_median(values, 0.95, 400, random);
    holds += interval.low <= 0 && interval.high >= 0;
  }
  CHECK(holds >= 368);  // 0.95 of 400 less three standard deviations
  CHECK(holds <= 396);
  const double infinity = std::numeric_limits<double>::infinity();
  const Interval failed = bootstrap_median({1, 2, infinity, infinity, infinity}, 0.95, 1000, random);
  CHECK(failed.low <= 2);
  CHECK(failed.high == infinity);
}

TEST_CASE("the e-value is the mixture's likelihood ratio, and its chance to reach 1/alpha under the null is small") {
  // n = 0: no evidence. n = 1, a success: 2^2 int t dt over (1/2, 1) = 3/2.
  CHECK(log_e_value(0, 0) == Approx(0).margin(1e-12));
  CHECK(std::exp(log_e_value(1, 1)) == Approx(1.5));
  CHECK(std::exp(log_e_value(0, 1)) == Approx(0.5));
  // A fair bet: under P = 1/2 the expectation does not change.
  for (const Index n : {1, 5, 40})
    for (Index k = 0; k <= n; ++k)
      CHECK(0.5 * (std::exp(log_e_value(k + 1, n + 1)) + std::exp(log_e_value(k, n + 1))) ==
            Approx(std::exp(log_e_value(k, n))));
  Random random = numbers(4);
  int reached = 0;
  const int sequences = 2000;
  for (int s = 0; s < sequences; ++s) {
    Index k = 0;
    for (Index n = 1; n <= 400; ++n) {
      k += random.uniform() < 0.5;
      if (log_e_value(k, n) < std::log(20)) continue;
      ++reached;
      break;
    }
  }
  CHECK(reached <= 0.05 * sequences);
  CHECK(reached > 0);
  CHECK(log_e_value(30, 30) > std::log(20));
}
