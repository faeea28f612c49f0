// Statistics of paired comparisons against their definitions and published numbers.
#include "experiments/compare/statistics.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "core/base/random.hpp"
#include "experiments/compare/pairing.hpp"
#include "experiments/run/statistics.hpp"

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

TEST_CASE("the signed-rank test gives the published p-values") {
  const auto minus = [](const std::vector<double>& x, const std::vector<double>& y) {
    std::vector<double> d;
    for (std::size_t i = 0; i < x.size(); ++i) d.push_back(std::round((x[i] - y[i]) * 1e9) / 1e9);
    return d;
  };
  // Hollander & Wolfe 1973, p. 29: depression scale; R's help page of wilcox.test.
  const SignedRank depression = wilcoxon_signed_rank(minus({1.83, 0.50, 1.62, 2.48, 1.68, 1.88, 1.55, 3.06, 1.30},
                                                           {0.878, 0.647, 0.598, 2.05, 1.06, 1.29, 1.06, 3.14, 1.29}),
                                                     Zeros::drop);
  CHECK(depression.positive == 40);
  CHECK(depression.p == Approx(0.0390625));
  CHECK(rank_biserial(depression) == Approx(0.777).margin(1e-3));  // R's effectsize, Kerby's formula
  // SciPy's test_exact_pval, values by R 3.4.1.
  const SignedRank ten = wilcoxon_signed_rank(minus({1.81, 0.82, 1.56, -0.48, 0.81, 1.28, -1.04, 0.23, -0.75, 0.14},
                                                    {0.71, 0.65, -0.2, 0.85, -1.1, -0.45, -0.84, -0.24, -0.68, -0.76}),
                                              Zeros::drop);
  CHECK(ten.p == Approx(0.1054688).margin(5e-8));
  // SAS PROC UNIVARIATE, ties and zeros: signed rank 16.5 beyond its mean, p 0.0234.
  const SignedRank sas = wilcoxon_signed_rank({2, 2, 2, 0, 2, 4, 0, 1, -1, 2}, Zeros::drop);
  CHECK(sas.positive - 18 == 16.5);
  CHECK(sas.p == Approx(0.0234).margin(5e-5));
  // Student's sleep data with Pratt's zeros: exact p 0.0039 by R's coin.
  const SignedRank sleep = wilcoxon_signed_rank(minus({0.7, -1.6, -0.2, -1.2, -0.1, 3.4, 3.7, 0.8, 0.0, 2.0},
                                                      {1.9, 0.8, 1.1, 0.1, -0.1, 4.4, 5.5, 1.6, 4.6, 3.4}),
                                                Zeros::pratt);
  CHECK(sleep.p == Approx(0.0039).margin(5e-5));
  // Fifty pairs with thirteen zeros: exact Pratt 1.474e-06 by R's coin, normal without zeros 1.167e-05 by wilcox.test.
  const std::vector<double> fifty = minus({6, 4, 5, 5, 7, 6, 6, 6, 7, 6, 6, 5, 6, 6, 5, 5, 3, 6, 6, 5, 6, 5, 4, 6, 6,
                                           6, 7, 4, 3, 4, 6, 6, 5, 6, 4, 6, 6, 5, 7, 6, 6, 5, 6, 7, 6, 6, 6, 5, 7, 7},
                                          {5, 3, 5, 3, 5, 3, 6, 2, 3, 6, 2, 5, 5, 6, 4, 6, 4, 5, 5, 3, 7, 5, 6, 6, 4,
                                           3, 4, 3, 2, 4, 5, 4, 4, 6, 2, 6, 7, 4, 4, 5, 5, 5, 5, 7, 4, 5, 3, 2, 6, 7});
  CHECK(wilcoxon_signed_rank(fifty, Zeros::pratt).p == Approx(1.474e-6).epsilon(5e-4));
  CHECK(wilcoxon_signed_rank(fifty, Zeros::drop, 0).p == Approx(1.167e-5).epsilon(5e-4));
  CHECK(wilcoxon_signed_rank(fifty, Zeros::drop, 0).positive == 636.5);
  // SciPy's test_accuracy_wilcoxon and test_wilcoxon_tie, values by R with continuity correction.
  CHECK(wilcoxon_signed_rank(minus({120, 114, 181, 188, 180, 146, 121, 191, 132, 113, 127, 112},
                                   {133, 143, 119, 189, 112, 199, 198, 113, 115, 121, 142, 187}),
                             Zeros::drop, 0)
            .p == Approx(0.7240817).margin(5e-8));
  CHECK(wilcoxon_signed_rank(std::vector<double>(10, 0.1), Zeros::drop, 0).p == Approx(0.001904195).margin(5e-10));
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
  const std::vector<double> textbook = holm({0.01, 0.04, 0.03, 0.005}), same = {0.03, 0.06, 0.06, 0.02};
  for (std::size_t i = 0; i < same.size(); ++i) CHECK(textbook[i] == Approx(same[i]));
  // R 4.5.2, p.adjust(method = "holm").
  const std::vector<double> adjusted = holm({0.001, 0.01, 0.05, 0.1, 0.5, 0.9}),
                            expected = {0.006, 0.05, 0.2, 0.3, 1, 1};
  for (std::size_t i = 0; i < expected.size(); ++i) CHECK(adjusted[i] == Approx(expected[i]));
  CHECK(holm({}).empty());
  CHECK(holm({0.9, 0.8}) == std::vector<double>{1, 1});
}

TEST_CASE("Nemenyi's quantiles are those of Demsar 2006, Table 5(a)") {
  const double at_05[] = {1.960, 2.343, 2.569, 2.728, 2.850, 2.949, 3.031, 3.102, 3.164};
  const double at_10[] = {1.645, 2.052, 2.291, 2.459, 2.589, 2.693, 2.780, 2.855, 2.920};
  for (Index k = 2; k <= 10; ++k) {
    // The last printed digit of that table is off by up to one.
    CHECK(nemenyi_quantile(k, 0.05) == Approx(at_05[k - 2]).margin(1.1e-3));
    CHECK(nemenyi_quantile(k, 0.10) == Approx(at_10[k - 2]).margin(1.1e-3));
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

TEST_CASE("Friedman's test gives the published statistics") {
  // Hollander & Wolfe 1999, Table 7.1: rounding first base; R's help page of friedman.test.
  Matrix base(22, 3);
  base << 5.40, 5.50, 5.55, 5.85, 5.70, 5.75, 5.20, 5.60, 5.50, 5.55, 5.50, 5.40, 5.90, 5.85, 5.70, 5.45, 5.55, 5.60,
      5.40, 5.40, 5.35, 5.45, 5.50, 5.35, 5.25, 5.15, 5.00, 5.85, 5.80, 5.70, 5.25, 5.20, 5.10, 5.65, 5.55, 5.45, 5.60,
      5.35, 5.45, 5.05, 5.00, 4.95, 5.50, 5.50, 5.40, 5.45, 5.55, 5.50, 5.55, 5.55, 5.35, 5.45, 5.50, 5.55, 5.50, 5.45,
      5.25, 5.65, 5.60, 5.40, 5.70, 5.65, 5.55, 6.30, 6.30, 6.25;
  const Friedman first_base = friedman(base);
  CHECK(first_base.chi2 == Approx(11.143).margin(5e-4));
  CHECK(first_base.p == Approx(0.003805).margin(5e-7));
  CHECK(first_base.mean_ranks(2) * 22 == Approx(32));
  // Demsar 2006, Table 6, as SciPy tests it (ties corrected); smaller AUC has the smaller rank here.
  Matrix auc(14, 4);
  auc << 0.763, 0.768, 0.771, 0.798, 0.599, 0.591, 0.590, 0.569, 0.954, 0.971, 0.968, 0.967, 0.628, 0.661, 0.654, 0.657,
      0.882, 0.888, 0.886, 0.898, 0.936, 0.931, 0.916, 0.931, 0.661, 0.668, 0.609, 0.685, 0.583, 0.583, 0.563, 0.625,
      0.775, 0.838, 0.866, 0.875, 1, 1, 1, 1, 0.940, 0.962, 0.965, 0.962, 0.619, 0.666, 0.614, 0.669, 0.972, 0.981,
      0.9751, 0.975, 0.957, 0.978, 0.946, 0.970;
  const Friedman learners = friedman(-auc);
  CHECK(learners.chi2 == Approx(10.2283464566929).epsilon(1e-12));
  CHECK(learners.p == Approx(0.0167215803284414).epsilon(1e-10));
  const double ranks[] = {3.143, 2.000, 2.893, 1.964};
  for (Index j = 0; j < 4; ++j) CHECK(learners.mean_ranks(j) == Approx(ranks[j]).margin(5e-4));
  // Zar, Biostatistical Analysis, example 12.6: 10.68.
  Matrix zar(5, 4);
  zar << 7.0, 5.3, 4.9, 8.8, 9.9, 5.7, 7.6, 8.9, 8.5, 4.7, 5.5, 8.1, 5.1, 3.5, 2.8, 3.3, 10.3, 7.7, 8.4, 9.1;
  CHECK(friedman(zar).chi2 == Approx(10.68));
  CHECK(friedman(zar).p == Approx(0.0135882729582176).epsilon(1e-10));
  // Nine methods on two data sets, R's scmamp: chi2 11.733, p 0.1635, Iman-Davenport 2.75, p 0.08697.
  Matrix nine(2, 9);
  nine << 1, 8, 6, 4, 7, 2, 5, 3, 9, 1, 6, 3, 9, 7, 2, 8, 4, 5;
  CHECK(friedman(nine).chi2 == Approx(11.733).margin(5e-4));
  CHECK(friedman(nine).p == Approx(0.1635).margin(5e-5));
  CHECK(friedman(nine).f == Approx(2.75));
  CHECK(friedman(nine).p_f == Approx(0.08697).margin(5e-6));
}

TEST_CASE("performance profiles are those of Siqueira et al. 2016 (perprof-py) on five problems") {
  const double failed = std::numeric_limits<double>::infinity();
  const std::vector<double> a = {1, 2, 2, failed, failed}, b = {4, 1, 1, 1, failed};
  const double tau[] = {1, 2, 4}, of_a[] = {0.2, 0.6, 0.6}, of_b[] = {0.6, 0.6, 0.8};
  for (int i = 0; i < 3; ++i) {
    CHECK(performance_profile(a, tau[i]) == Approx(of_a[i]));
    CHECK(performance_profile(b, tau[i]) == Approx(of_b[i]));
  }
}

TEST_CASE("quantiles change sign and side with their values, infinite ones too") {
  const double infinity = std::numeric_limits<double>::infinity();
  Random random = numbers(7);
  for (int trial = 0; trial < 200; ++trial) {
    std::vector<double> values, negative;
    for (Index i = 1 + random.integer(6); i > 0; --i) {
      const double u = random.uniform();
      values.push_back(u < 0.2 ? -infinity : u > 0.8 ? infinity : random.normal());
      negative.push_back(-values.back());
    }
    std::sort(values.begin(), values.end());
    std::sort(negative.begin(), negative.end());
    for (const double p : {0.0, 0.25, 0.5, 0.75, 1.0}) {
      const double q = quantile(values, p), mirrored = -quantile(negative, 1 - p);
      CHECK_FALSE(std::isnan(q));
      CHECK((q == mirrored || q == Approx(mirrored)));
    }
  }
  CHECK(quantile({1, infinity}, 0.5) == infinity);
  CHECK(quantile({-infinity, 1}, 0.5) == -infinity);
  CHECK(quantile({-infinity, infinity}, 0.5) == 0);
  CHECK(quantile({1, infinity}, 0.25) == 1);
}

TEST_CASE("a realisation is one observation, however many pooled cells it has") {
  Random random = numbers(8);
  const double missing = std::numeric_limits<double>::quiet_NaN(), failed = -std::numeric_limits<double>::infinity();
  Pairing pairing{"linear_vaf_axle", Better::larger, Json::object(), {}};
  for (Index r = 0; r < 7; ++r)
    for (std::size_t cell = 0; cell < 5; ++cell) {
      const double one = random.normal(), other = random.normal();
      pairing.values[r][{cell}] = {one, other};
    }
  const std::vector<Difference> all = differences(pairing, 0, 1);
  REQUIRE(all.size() == 7);
  for (const Difference& one : all) {
    std::vector<double> own;
    for (const auto& [cell, row] : pairing.values[one.realisation]) own.push_back(row[0] - row[1]);
    CHECK(one.value == median(own));
  }
  const Matrix blocks = blocks_by_realisation(pairing, 2);
  CHECK(blocks.rows() == 7);
  CHECK(blocks_by_cell(pairing, 2).rows() == 35);
  // Copies of a cell add nothing.
  Pairing copied = pairing;
  for (auto& [realisation, cells] : copied.values)
    for (std::size_t cell = 0; cell < 5; ++cell) cells[{cell + 5}] = cells[{cell}];
  for (std::size_t i = 0; i < 7; ++i) CHECK(differences(copied, 0, 1)[i].value == all[i].value);
  CHECK(blocks_by_realisation(copied, 2) == blocks);
  // Missing rows leave their cell out; two rows without a value do not differ.
  pairing.values[0] = {{{0}, {missing, 1}}, {{1}, {failed, failed}}, {{2}, {failed, 2}}};
  CHECK(differences(pairing, 0, 1).front().value == failed);
  pairing.values[0] = {{{1}, {failed, failed}}};
  CHECK(differences(pairing, 0, 1).front().value == 0);
  pairing.values[0] = {{{0}, {missing, 1}}};
  CHECK(differences(pairing, 0, 1).front().realisation == 1);
  CHECK(blocks_by_realisation(pairing, 2).rows() == 6);
  // Smaller is better: the same numbers give the opposite sign.
  Pairing smaller = pairing;
  smaller.way = Better::smaller;
  CHECK(differences(smaller, 0, 1).front().value == -differences(pairing, 0, 1).front().value);
  CHECK(blocks_by_realisation(smaller, 2) == -blocks_by_realisation(pairing, 2));
}

TEST_CASE("the range of n values holds their distribution's median with probability 1 - 2^(1-n)") {
  CHECK(coverage_of_range(1) == 0);
  CHECK(coverage_of_range(5) < 0.95);
  CHECK(coverage_of_range(6) == 1 - 1.0 / 32);
}

TEST_CASE("the bootstrap of the median has the distribution of resampled medians") {
  // Efron & Tibshirani 1993, Table 2.1, treated mice. Of all 7^7 resamples the medians are 16, 23, 38, 94, 99, 141, 197
  // with probability 0.0102, 0.0981, 0.2386, 0.3062, 0.2386, 0.0981, 0.0102.
  const std::vector<double> mice = {94, 197, 16, 38, 99, 141, 23};
  const auto ends = [&](double level) {
    const Interval interval = bootstrap_median(mice, level);
    return std::pair(interval.low, interval.high);
  };
  CHECK(ends(0.95) == std::pair(23.0, 141.0));
  CHECK(ends(0.99) == std::pair(16.0, 197.0));
  CHECK(ends(0.70) == std::pair(38.0, 99.0));
  // Against resampling itself.
  Random random = numbers(5);
  std::vector<double> values, medians;
  for (int i = 0; i < 25; ++i) values.push_back(random.normal());
  for (int b = 0; b < 20000; ++b) {
    std::vector<double> sample;
    for (std::size_t i = 0; i < values.size(); ++i)
      sample.push_back(values[static_cast<std::size_t>(random.integer(25))]);
    medians.push_back(median(sample));
  }
  std::sort(medians.begin(), medians.end());
  const Interval interval = bootstrap_median(values, 0.95);
  const auto share_below = [&](double x) {
    return static_cast<double>(std::lower_bound(medians.begin(), medians.end(), x) - medians.begin()) / 20000;
  };
  CHECK(share_below(interval.low) < 0.03);
  CHECK(share_below(std::nextafter(interval.low, 1e9)) > 0.02);
  CHECK(share_below(interval.high) < 0.98);
  CHECK(share_below(std::nextafter(interval.high, 1e9)) > 0.97);
}

TEST_CASE("the bootstrap interval of the median holds it at its level, and failures do not break it") {
  Random random = numbers(3);
  for (const int n : {20, 41}) {
    int holds = 0;
    for (int trial = 0; trial < 400; ++trial) {
      std::vector<double> values;
      for (int i = 0; i < n; ++i) values.push_back(random.normal());
      const Interval interval = bootstrap_median(values, 0.95);
      holds += interval.low <= 0 && interval.high >= 0;
    }
    CHECK(holds >= 366);  // 0.95 of 400 less three standard deviations
    CHECK(holds <= 399);
  }
  const double infinity = std::numeric_limits<double>::infinity();
  const Interval failed = bootstrap_median({1, 2, infinity, infinity, infinity}, 0.95);
  CHECK(failed.low <= 2);
  CHECK(failed.high == infinity);
  CHECK(bootstrap_median({3}, 0.95).low == 3);
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

TEST_CASE("claims made while looking: at most 5 % of sweeps hold a wrong one, with fewer rows than a fixed number") {
  // Three methods. Two are equal: a planted tie, whose differences are symmetric about zero, so that with an
  // equivalence of zero no claim about it is right. The third is worse by 0.7 to 3 standard deviations, drawn for each
  // sweep.
  Random random = numbers(6);
  const Index sweeps = 1000, at_most = 200;
  const double threshold = std::log(3 * 3 / 0.05);
  Index wrong = 0, found = 0, rows = 0;
  for (Index s = 0; s < sweeps; ++s) {
    const double worse = 0.7 + 2.3 * random.uniform();
    SequentialClaim tie(0, threshold), first(0, threshold), second(0, threshold);
    Index used = 0;
    for (; used < at_most && (first.claim() == Claim::none || second.claim() == Claim::none); ++used) {
      const double a = random.normal(), b = random.normal(), c = random.normal() - worse;
      tie.add(a - b);
      first.add(a - c);
      second.add(b - c);
    }
    const auto is_wrong = [](const SequentialClaim& one) {
      return one.claim() == Claim::b_better || one.claim() == Claim::equivalent;
    };
    wrong += tie.claim() != Claim::none || is_wrong(first) || is_wrong(second);
    found += first.claim() == Claim::a_better && second.claim() == Claim::a_better;
    rows += used;
  }
  CHECK(wrong <= 0.05 * static_cast<double>(sweeps));
  const double power = static_cast<double>(found) / static_cast<double>(sweeps);
  const double mean_rows = static_cast<double>(rows) / static_cast<double>(sweeps);
  // The fixed number of realisations at which Wilcoxon's tests with Holm's correction find both as often.
  const auto fixed_power = [&](Index n) {
    Index both = 0;
    const Index trials = 300;
    for (Index t = 0; t < trials; ++t) {
      const double worse = 0.7 + 2.3 * random.uniform();
      std::vector<double> tie, first, second;
      for (Index i = 0; i < n; ++i) {
        const double a = random.normal(), b = random.normal(), c = random.normal() - worse;
        tie.push_back(a - b);
        first.push_back(a - c);
        second.push_back(b - c);
      }
      std::vector<double> p;
      for (const auto* d : {&tie, &first, &second}) p.push_back(wilcoxon_signed_rank(*d, Zeros::pratt).p);
      p = holm(p);
      both += p[1] < 0.05 && p[2] < 0.05;
    }
    return static_cast<double>(both) / static_cast<double>(trials);
  };
  Index fixed = 5;
  while (fixed < at_most && fixed_power(fixed) < power) fixed += 5;
  CAPTURE(power, mean_rows, fixed, wrong);
  CHECK(power > 0.95);
  CHECK(mean_rows < static_cast<double>(fixed));
}
