// Rival explanations: what their probabilities depend on.
#include <catch2/catch.hpp>
#include <cmath>

#include "core/base/random.hpp"
#include "core/gap/rivals.hpp"

using namespace wheelhop;

namespace {

Rival rival(const std::string& effect, double chi2, double plausibility = 0) {
  return {effect, "spring", 0, false, chi2, 0, plausibility};
}

double probability_of(const std::vector<Rival>& rivals, const std::string& effect) {
  for (const Rival& r : rivals)
    if (r.effect == effect) return r.probability;
  return 0;
}

}  // namespace

TEST_CASE("the rival that leaves least is the most probable, equals are equal, and none is certain") {
  std::vector<Rival> rivals = {rival("a", 3000), rival("b", 1000), rival("c", 1e6)};
  weigh(rivals, {1, 1e3, 1000});
  CHECK(rivals.front().effect == "b");
  CHECK(rivals.front().probability == 0.99);
  CHECK(probability_of(rivals, "c") < 1e-6);
  rivals = {rival("a", 1000), rival("b", 1000)};
  weigh(rivals, {1, 1e5, 1000});
  CHECK(rivals[0].probability == Approx(0.5));
}

TEST_CASE("a difference means less the larger the gap, the more is left, and the more the noise is coloured") {
  const auto winner = [](double colour, double gap, double floor) {
    std::vector<Rival> rivals = {rival("a", 1000), rival("b", 1006)};
    weigh(rivals, {colour, gap, floor});
    return probability_of(rivals, "a");
  };
  CHECK(winner(1, 0, 1000) == Approx(1 / (1 + std::exp(-3.0))).epsilon(1e-3));
  CHECK(winner(1, 1e4, 1000) < winner(1, 1e3, 1000));
  CHECK(winner(1, 0, 500) < winner(1, 0, 1000));
  CHECK(winner(8, 0, 1000) < winner(1, 0, 1000));
}

TEST_CASE("parameters that left their tolerances speak louder than residuals, in coloured noise too") {
  for (const double colour : {1.0, 100.0}) {
    std::vector<Rival> rivals = {rival("a", 1000), rival("b", 1000)};
    rivals[1].chi2 += rivals[1].prior_chi2 = 6;  // the same residuals
    weigh(rivals, {colour, 0, 1000});
    CHECK(probability_of(rivals, "a") == Approx(1 / (1 + std::exp(-3.0 / std::sqrt(colour)))));
  }
}

TEST_CASE("of an effect's forms the most probable counts, and an implausible size costs") {
  std::vector<Rival> rivals = {rival("a", 1000, -20), rival("a", 1001), rival("b", 1000)};
  weigh(rivals, {1, 1000, 1000});
  REQUIRE(rivals.size() == 2);
  CHECK(probability_of(rivals, "a") > 0.4);
  rivals = {rival("a", 1000, -3), rival("b", 1000)};
  weigh(rivals, {1, 1000, 1000});
  CHECK(probability_of(rivals, "b") == Approx(1 / (1 + std::exp(-3.0))));
}

TEST_CASE("one parameter stands out where it is off and the data put all others near to what is known of them") {
  const Index count = 6, odd = 2;
  const auto fit_of = [&](const Vector& told, const Vector& truth) {  // the data see each parameter by itself
    PlantFit fit;
    fit.covariance = (told.array() + 1).inverse().matrix().asDiagonal();
    fit.theta = truth.array() * told.array() / (told.array() + 1);
    return fit;
  };
  const Vector seen = Vector::Constant(count, 100.0);
  Vector truth = Vector::Constant(count, 0.1);
  for (const double off : {1.5, -1.5, 4.0}) {
    truth(odd) = off;
    const Vector p = standing_out(fit_of(seen, truth), count, 1);
    CHECK(p(odd) > 0.8);
    CHECK(p.sum() <= 1);
    CHECK(p.maxCoeff() <= kLimit);
    // Others that are as far off, or of which the data say nothing, make it one of many.
    CHECK(standing_out(fit_of(seen, truth.cwiseSign() * std::abs(off)), count, 1).maxCoeff() < 0.2);
    CHECK(standing_out(fit_of(1e-3 * seen, truth), count, 1).sum() < 0.25);
    // Coloured noise counts for less.
    CHECK(standing_out(fit_of(seen, truth), count, 50)(odd) < p(odd));
  }
  truth(odd) = 0.1;
  CHECK(standing_out(fit_of(seen, truth), count, 1).maxCoeff() < 0.05);
}

TEST_CASE("among parameters within two tolerances one hardly ever stands out") {
  Random random(5, Stream::parameters);
  const Index count = 8, draws = 500;
  Index named = 0;
  for (Index draw = 0; draw < draws; ++draw) {
    PlantFit fit;
    const Matrix half = 5 * random.normal(count, count);
    const Vector truth = random.normal(count, 1).cwiseMin(2).cwiseMax(-2), error = random.normal(count, 1);
    const Matrix told = half.transpose() * half;
    fit.covariance = (told + Matrix::Identity(count, count)).inverse();
    fit.theta = fit.covariance * (told * truth + half.transpose() * error);
    named += standing_out(fit, count, 1).maxCoeff() > 2.0 / 3 ? 1 : 0;
  }
  CHECK(named <= 0.01 * draws);
}
