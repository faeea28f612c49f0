// Posterior probabilities of candidates: what they depend on.
#include <catch2/catch.hpp>
#include <cmath>

#include "core/base/random.hpp"
#include "core/gap/verdict/posterior.hpp"
#include "tests/support/places.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

namespace {

RankedCandidate candidate(const EffectId& effect, double chi2, double log_prior = 0) {
  return {effect, "spring"_at, 0, false, chi2, 0, log_prior};
}

struct Posterior {
  Vector theta;
  Matrix covariance;
};

double probability_of(const std::vector<RankedCandidate>& list, const EffectId& effect) {
  for (const RankedCandidate& r : list)
    if (r.effect == effect) return r.probability;
  return 0;
}

}  // namespace

TEST_CASE("the candidate that leaves least is the most probable, equals are equal, and none is certain") {
  std::vector<RankedCandidate> list = {candidate("a", 3000), candidate("b", 1000), candidate("c", 1e6)};
  rank(list, {1, 1e3, 1000}, {});
  CHECK(list.front().effect == "b");
  CHECK(list.front().probability == 0.99);
  CHECK(probability_of(list, "c") < 1e-6);
  list = {candidate("a", 1000), candidate("b", 1000)};
  rank(list, {1, 1e5, 1000}, {});
  CHECK(list[0].probability == Approx(0.5));
}

TEST_CASE("a difference means less the larger the gap, the more is left, and the more the noise is coloured") {
  const auto winner = [](double colour, double gap, double floor) {
    std::vector<RankedCandidate> list = {candidate("a", 1000), candidate("b", 1006)};
    rank(list, {colour, gap, floor}, {});
    return probability_of(list, "a");
  };
  CHECK(winner(1, 0, 1000) == Approx(1 / (1 + std::exp(-3.0))).epsilon(1e-3));
  CHECK(winner(1, 1e4, 1000) < winner(1, 1e3, 1000));
  CHECK(winner(1, 0, 500) < winner(1, 0, 1000));
  CHECK(winner(8, 0, 1000) < winner(1, 0, 1000));
  // Where a candidate closes the gap to the floor, one that leaves more is less likely the right one in another form.
  CHECK(winner(1, 1e4, 1000) > winner(1, 1e4, 900));
}

TEST_CASE(
    "of a gap far above the noise, what nearly closes it is more probable than what leaves a hundred times as much") {
  // Either leaves little of the gap, yet a wrong family does not nearly close it by chance.
  const auto winner = [](double left) {
    std::vector<RankedCandidate> list = {candidate("a", 1000), candidate("b", 1000 + left)};
    rank(list, {1, 1e8, 1000}, {});
    return probability_of(list, "a");
  };
  CHECK(winner(0) == Approx(0.5));
  CHECK(winner(40) == Approx(0.5).margin(1e-3));  // within the error of the floor
  for (const double left : {1e2, 1e3, 1e4}) CHECK(winner(10 * left) > winner(left) + 0.02);
  CHECK(winner(1e6) > winner(1e5));
  CHECK(winner(1e3) < 0.9);
}

TEST_CASE("parameters that left their tolerances speak louder than residuals, in coloured noise too") {
  for (const double colour : {1.0, 100.0}) {
    std::vector<RankedCandidate> list = {candidate("a", 1000), candidate("b", 1000)};
    list[1].chi2 += list[1].prior_chi2 = 6;  // the same residuals
    rank(list, {colour, 0, 1000}, {});
    CHECK(probability_of(list, "a") == Approx(1 / (1 + std::exp(-3.0 / std::sqrt(colour)))));
  }
}

TEST_CASE("of an effect's forms the most probable counts, and an implausible size costs") {
  std::vector<RankedCandidate> list = {candidate("a", 1000, -20), candidate("a", 1001), candidate("b", 1000)};
  rank(list, {1, 1000, 1000}, {});
  REQUIRE(list.size() == 2);
  CHECK(probability_of(list, "a") > 0.4);
  list = {candidate("a", 1000, -3), candidate("b", 1000)};
  rank(list, {1, 1000, 1000}, {});
  CHECK(probability_of(list, "b") == Approx(1 / (1 + std::exp(-3.0))));
}

TEST_CASE("laws of one instrument are nearly exact: their difference counts, and other places gain nothing by it") {
  const auto ranked = [](const Place& place, double behind, bool in_pairs) {
    std::vector<RankedCandidate> list = {{"time_delay", place, 0, false, 1000, 0, 0},
                                         {"sensor_lag", place, 1, false, 1000 + behind, 0, 0},
                                         {"coulomb_friction", "suspension"_at, 2, false, 1100, 0, 0}};
    if (in_pairs)
      for (RankedCandidate& own : list) own.set = {own.name(), "tyre_damping@tyre"_effect};
    rank(list, {1, 1e4, 1000}, {});
    return list;
  };
  for (const bool in_pairs : {false, true}) {
    CHECK(probability_of(ranked("spring"_at, 30, in_pairs), "sensor_lag") > 0.3);
    const std::vector<RankedCandidate> tie = ranked("sensor:travel"_at, 0, in_pairs);
    CHECK(probability_of(tie, "sensor_lag") == Approx(probability_of(tie, "time_delay")));
    for (const double behind : {5.0, 30.0}) {
      const std::vector<RankedCandidate> list = ranked("sensor:travel"_at, behind, in_pairs);
      CHECK(probability_of(list, "sensor_lag") < std::exp(-0.22 * behind));
      // Another place is as probable as beside two laws of one spring.
      CHECK(probability_of(list, "coulomb_friction") ==
            Approx(probability_of(ranked("spring"_at, behind, in_pairs), "coulomb_friction")));
    }
    // What differs in more than its instruments is weighed as before.
    std::vector<RankedCandidate> elsewhere = ranked("sensor:travel"_at, 0, in_pairs);
    elsewhere[1].location = "sensor:body_acc"_at;
    if (in_pairs) elsewhere[1].set[0] = elsewhere[1].name();
    elsewhere[1].chi2 = elsewhere[0].chi2 + 30;
    rank(elsewhere, {1, 1e4, 1000}, {});
    CHECK(elsewhere[1].probability > 0.3);
  }
}

TEST_CASE("one parameter stands out where it is off and the data put all others near to what is known of them") {
  const Index count = 6, odd = 2;
  const auto fit_of = [&](const Vector& told, const Vector& truth) {  // the data see each parameter by itself
    Posterior fit;
    fit.covariance = (told.array() + 1).inverse().matrix().asDiagonal();
    fit.theta = truth.array() * told.array() / (told.array() + 1);
    return fit;
  };
  const auto stands = [](const Posterior& fit, double colour) {
    return standing_out(fit.theta, fit.covariance, colour, {});
  };
  const Vector seen = Vector::Constant(count, 100.0);
  Vector truth = Vector::Constant(count, 0.1);
  for (const double off : {1.5, -1.5, 4.0}) {
    truth(odd) = off;
    const Vector p = stands(fit_of(seen, truth), 1);
    CHECK(p(odd) > 0.8);
    CHECK(p.sum() <= 1);
    CHECK(p.maxCoeff() <= Thresholds{}.limit);
    // Others that are as far off, or of which the data say nothing, make it one of many.
    CHECK(stands(fit_of(seen, truth.cwiseSign() * std::abs(off)), 1).maxCoeff() < 0.2);
    CHECK(stands(fit_of(1e-3 * seen, truth), 1).sum() < 0.25);
    // Coloured noise counts for less.
    CHECK(stands(fit_of(seen, truth), 50)(odd) < p(odd));
  }
  truth(odd) = 0.1;
  CHECK(stands(fit_of(seen, truth), 1).maxCoeff() < 0.05);
}

TEST_CASE("among parameters within two tolerances one hardly ever stands out") {
  Random random(5, Stream::parameters);
  const Index count = 8, draws = 500;
  Index named = 0;
  for (Index draw = 0; draw < draws; ++draw) {
    Posterior fit;
    const Matrix half = 5 * random.normal(count, count);
    const Vector truth = random.normal(count, 1).cwiseMin(2).cwiseMax(-2), error = random.normal(count, 1);
    const Matrix told = half.transpose() * half;
    fit.covariance = (told + Matrix::Identity(count, count)).inverse();
    fit.theta = fit.covariance * (told * truth + half.transpose() * error);
    named += standing_out(fit.theta, fit.covariance, 1, {}).maxCoeff() > 2.0 / 3 ? 1 : 0;
  }
  CHECK(named <= 0.01 * draws);
}

TEST_CASE("rivals share their probability by misfit and blocks, equals equally, and none is ever certain") {
  const Vector equal = probabilities_by_leftover(Vector::Constant(4, 1.3), 20, 0.99);
  for (const double p : equal) CHECK(p == Approx(0.25));
  const Vector misfits = (Vector(2) << 1.0, 1.1).finished();
  const Vector few = probabilities_by_leftover(misfits, 10, 0.99), many = probabilities_by_leftover(misfits, 100, 0.99);
  CHECK(few(0) / few(1) == Approx(std::pow(1.1, 5)));
  CHECK(many(0) > few(0));
  CHECK(probabilities_by_leftover((Vector(2) << 1.0, 50.0).finished(), 100, 0.99)(0) == 0.99);
}
