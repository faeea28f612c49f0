// What each of several effects contributes: the axioms of Shapley's value, and two effects in one plant.
#include <algorithm>
#include <bit>
#include <catch2/catch.hpp>
#include <cmath>

#include "core/gap/which/shares.hpp"
#include "core/plant/dataset.hpp"
#include "tests/support/places.hpp"
#include "tests/support/plants.hpp"
#include "tests/support/systems.hpp"
#include "variants/solver/levenberg_marquardt.hpp"
#include "variants/table.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

TEST_CASE("shares sum to the worth of all less that of none, whatever the game") {
  Random random = numbers(851);
  for (const Index n : {0, 1, 2, 3, 5}) {
    const Vector worth = random.normal(Index{1} << n, 1);
    const Vector shares = shapley_values(worth);
    REQUIRE(shares.size() == n);
    CHECK(shares.sum() == Approx(worth(worth.size() - 1) - worth(0)).margin(1e-12));
  }
  CHECK_THROWS_AS(shapley_values(Vector::Zero(3)), std::invalid_argument);
}

TEST_CASE("players that add the same share equally, one that adds nothing has 0, and a sum of games shares the sum") {
  // Three players; worth by the number of members alone.
  Vector symmetric(8), idle(8);
  for (unsigned set = 0; set < 8; ++set) {
    symmetric(set) = std::pow(std::popcount(set), 1.7);
    idle(set) = std::sin(1.0 + (set & 5u));  // player 1 changes nothing
  }
  const Vector equal = shapley_values(symmetric), without = shapley_values(idle);
  for (const double share : equal) CHECK(share == Approx(equal.sum() / 3));
  CHECK(without(1) == Approx(0).margin(1e-15));
  CHECK(without(0) != Approx(without(2)));
  CHECK((shapley_values(symmetric + 2 * idle) - equal - 2 * without).norm() < 1e-14);
  // By hand: v(a) = 0.6, v(b) = 0.1, v(ab) = 1.
  const Vector two = shapley_values((Vector(4) << 0, 0.6, 0.1, 1).finished());
  CHECK(two(0) == Approx(0.75));
  CHECK(two(1) == Approx(0.25));
}

TEST_CASE("the shares of two effects in a plant make up the closure, whichever was found first") {
  const Plant nominal = plant_from(one_mass_text);
  Plant truth = nominal;
  truth.elements[0].laws.push_back({find_law("asymmetric_damper"), {4, 0.3, 0.1, 1, 1}});
  set_parameter(truth, "sensor:a.gain", 1.06);
  RecordSet set;
  set.sampling_hz = 250;
  Random random = numbers(852);
  for (const char* role : {"estimation", "validation"}) {
    Matrix drive(1, 8000);
    Vector poles = Vector::Zero(4);  // little above half the sampling rate, so that the record tells the drive
    for (double& value : drive.reshaped()) {
      value = 100 * random.normal();
      for (double& pole : poles) value = pole += 0.1 * (value - pole);
    }
    const GeneratedRecord made = generate_record(truth, drive, 250);
    REQUIRE(made.status == Status::ok);
    set.records.push_back({role, role, "", 0, made.signal});
    const Vector noise = 0.01 * made.signal.y.rowwise().norm() / std::sqrt(4000.0);
    for (Index i = 0; i < 3; ++i) set.noise_std[nominal.sensors[static_cast<std::size_t>(i)].name] = noise(i);
    set.records.back().signal.y += noise.asDiagonal() * random.normal(3, 4000);
  }
  const auto solver = make_levenberg_marquardt({});
  const GapData data = gap_data(nominal, set, noise_floor(set), 2);
  const GapSolvers solvers{*solver, *solver, *solver};
  const CandidateList candidates = effect_candidates;
  const Study study{nominal, data, solvers, candidates, tolerance_parameters(nominal)};
  const Hypothesis none = fit_hypothesis(study, nominal, study.tolerances);
  // The answer, as the search would hand it over: two candidates, one put upon the other, and their parameters.
  Hypothesis both = none;
  Plant plant = none.fit.plant;
  for (const EffectAt& name : {"damper_asymmetry@spring"_effect, "gain_error@sensor:a"_effect}) {
    Operation operation;
    REQUIRE(operation_of(plant, data.fitted, {}, operation));
    for (const EffectCandidate& candidate : candidates(plant, operation))
      if (name_of(candidate) == name) {
        both.effects.push_back(candidate);
        both.parameters.insert(both.parameters.end(), candidate.parameters.begin(), candidate.parameters.end());
        plant = candidate.plant;
        break;
      }
  }
  REQUIRE(both.effects.size() == 2);
  both.fit.plant = plant;
  both = fit_subset(study, none, both, 3);
  REQUIRE(both.stage.misfit < 1.2);
  // From its own solution a fit does not get worse, nor without an effect that does nothing.
  CHECK(fit_subset(study, none, both, 3).chi2 <= both.chi2 * (1 + 1e-9));
  const Hypothesis alone = fit_subset(study, none, both, 1);
  REQUIRE(alone.chi2 > 1.05 * both.chi2);
  Hypothesis idle = both;
  idle.fit = alone.fit;  // its sensors read as they should
  idle.held_out = alone.held_out;
  CHECK(fit_subset(study, none, idle, 1).chi2 <= alone.chi2 * (1 + 1e-9));
  const Vector shares = effect_shares(study, none, both, {});
  REQUIRE(shares.size() == 2);
  CHECK(shares.sum() == Approx(1 - (both.stage.misfit - 1) / (none.stage.misfit - 1)));
  CHECK(shares.minCoeff() > 0.02);
  // Fits that are known are not made again.
  const Hypothesis other = fit_subset(study, none, both, 2);
  CHECK(effect_shares(study, none, both, {alone, other}) == shares);
  Hypothesis nothing = alone;
  nothing.chi2 *= 0.5;
  nothing.stage = none.stage;
  CHECK(effect_shares(study, none, both, {alone, nothing})(0) < shares(0));
  // The order in which they were found does not count.
  std::swap(both.effects[0], both.effects[1]);
  const auto count = static_cast<std::ptrdiff_t>(study.tolerances.size());
  std::rotate(both.parameters.begin() + count,
              both.parameters.begin() + count + static_cast<std::ptrdiff_t>(both.effects[1].parameters.size()),
              both.parameters.end());
  const Vector swapped = effect_shares(study, none, both, {});
  REQUIRE(swapped.size() == 2);
  CHECK(swapped(0) == Approx(shares(1)).epsilon(0.02));
  CHECK(swapped(1) == Approx(shares(0)).epsilon(0.02));
}
