// Rival explanations: what their probabilities depend on.
#include <catch2/catch.hpp>
#include <cmath>

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
