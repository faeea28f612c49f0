// Before a test: sizes in noise levels, what parameters hide, what looks alike, and what of the menu helps.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "core/gap/plan/plan.hpp"
#include "core/gap/plan/plan_menu.hpp"
#include "core/gap/plan/responses.hpp"
#include "tests/support/places.hpp"
#include "tests/support/plants.hpp"
#include "tests/support/systems.hpp"
#include "variants/table.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

namespace {

/// Noise through four poles, held at the plant's rate: `seconds` of a drive with the given RMS and 1 % noise.
std::vector<FitRecord> drive_of(const Plant& plant, double level, double pole_hz, double seconds) {
  const double hold_hz = plant.hold_hz();
  Random random = numbers(700);
  FitRecord record;
  record.ratio = 5;
  record.drive.resize(plant.input_count(), static_cast<Index>(seconds * hold_hz));
  Matrix poles = Matrix::Zero(plant.input_count(), 4);
  for (Index k = 0; k < record.drive.cols(); ++k)
    for (Index i = 0; i < plant.input_count(); ++i) {
      double value = random.normal();
      for (Index stage = 0; stage < 4; ++stage)
        value = poles(i, stage) += 6.28 * pole_hz / hold_hz * (value - poles(i, stage));
      record.drive(i, k) = value;
    }
  record.drive *= level * std::sqrt(static_cast<double>(record.drive.size())) / record.drive.norm();
  std::vector<std::string> assumed;
  std::string message;
  std::vector<FitRecord> records = {record};
  records[0].weight_std = Vector::Ones(plant.sensor_count());
  Vector std;
  REQUIRE(plan_noise(plant, records, {}, std, assumed, message) == Status::ok);
  CHECK(assumed.size() == plant.sensors.size());
  records[0].weight_std = std;
  return records;
}

std::vector<EffectCandidate> all_of(const Plant& plant, const std::vector<FitRecord>& records) {
  Operation operation;
  REQUIRE(operation_of(plant, records, {}, operation));
  return effect_candidates(plant, operation);
}

std::vector<EffectCandidate> some_of(const Plant& plant, const std::vector<EffectId>& effects) {
  std::vector<EffectCandidate> list;
  for (EffectCandidate& candidate : all_of(plant, drive_of(plant, plant.input_count() == 1 ? 0.01 : 0.002, 3, 4)))
    if (std::find(effects.begin(), effects.end(), candidate.label().effect) != effects.end())
      list.push_back(std::move(candidate));
  return list;
}

EffectCandidate changed(const Plant& plant, const std::string& parameter, double factor) {
  EffectCandidate candidate{{{EffectId(parameter), ""}}, {}, plant, {}};
  set_parameter(candidate.plant, parameter, factor * get_parameter(plant, parameter));
  return candidate;
}

/// Every candidate with every one before it.
std::vector<CandidatePair> all_pairs(std::size_t candidates) {
  std::vector<CandidatePair> pairs;
  for (std::uint32_t a = 0; a < candidates; ++a)
    for (std::uint32_t b = 0; b < a; ++b) pairs.push_back({a, b});
  return pairs;
}

Visibility seen_with(const Plant& plant, const std::vector<EffectCandidate>& candidates,
                     const std::vector<FitRecord>& records) {
  Products sum;
  const std::vector<CandidatePair> pairs = all_pairs(candidates.size());
  const Responses r = responses(plant, candidates, {}, records, {.pairs = pairs},
                                [&](const Responses&, Index, const Products& products) { sum.add(products); });
  INFO(r.message);
  REQUIRE(r.status == Status::ok);
  return visibility(r, sum, pairs, plant.sensor_count());
}

}  // namespace

TEST_CASE("no drive of the menu changes what sets numbers of laws, and each changes what moves the plant") {
  const Plant plant = plant_from(semi_active_text);
  std::vector<FitRecord> records = drive_of(plant, 0.005, 3, 20);
  records[0].drive.row(1).setConstant(1.5);
  records[0].drive.row(1).tail(5000).setConstant(4);
  records[0].y = records[0].weight_std.asDiagonal() * numbers(701).normal(3, 4000);
  const std::vector<MenuDrive> menu = menu_drives(plant, records);
  CHECK(menu.size() >= 4);
  for (const MenuDrive& item : menu) {
    CAPTURE(item.name);
    CHECK(item.records[0].drive.row(1) == records[0].drive.row(1));
    if (item.inputs.empty()) CHECK(item.records[0].drive.row(0) != records[0].drive.row(0));
  }
}

TEST_CASE("an error that a parameter can follow inside its tolerance leaves nothing, one without tolerance shows") {
  const Plant plant = plant_from(quarter_car_text);
  const std::vector<FitRecord> records = drive_of(plant, 0.004, 4, 8);
  // A damper that the plant file holds beside the tyre's spring is a parameter; the same damper missing is an effect.
  Plant damped = plant;
  damped.elements[1].laws.push_back({find_law("viscous_damper"), {100}, 1});
  const std::string damping = "tyre.viscous_damper.damping_ns_per_m";
  const Visibility own = seen_with(
      damped, {changed(damped, "tyre.linear_spring.stiffness_n_per_m", 1.01), changed(damped, damping, 1.5)}, records);
  CHECK(own.size(0) < 0.05);
  CHECK(own.size(1) < 0.05);
  const Visibility missing = seen_with(plant, some_of(plant, {"tyre_damping"}), records);
  CHECK(missing.size(0) > 10 * own.size(1));
  CHECK(missing.size(0) > 0.5);
  CHECK((own.parameter_std.array() <= 1 + 1e-9).all());
  CHECK(own.parameter_std.minCoeff() < 0.7);
}

TEST_CASE("sizes go with one over the noise, cosines are symmetric and in [-1, 1], and an effect is its own twin") {
  const Plant plant = plant_from(quarter_car_text);
  std::vector<FitRecord> records = drive_of(plant, 0.004, 4, 6);
  std::vector<EffectCandidate> candidates =
      some_of(plant, {"damper_asymmetry", "coulomb_friction", "sensor_lag", "drift"});
  candidates.push_back(candidates.front());
  const Visibility quiet = seen_with(plant, candidates, records);
  // Parameters are known far better than their tolerances where the size is to scale: quiet records.
  for (FitRecord& record : records) record.weight_std *= 1e-2;
  const Visibility quieter = seen_with(plant, candidates, records);
  for (Index i = 0; i < quiet.size.size(); ++i) {
    CAPTURE(candidates[static_cast<std::size_t>(i)].label().effect, quiet.size(i));
    CHECK(quieter.size(i) <= 100 * quiet.size(i) * (1 + 1e-9));
    CHECK(quieter.size(i) == Approx(100 * quiet.size(i)).epsilon(0.1));
  }
  CHECK(quiet.cosine.cwiseAbs().maxCoeff() <= 1);
  const auto cosine = [&](std::size_t a, std::size_t b) {
    const auto [low, high] = std::minmax(a, b);
    return quiet.cosine(static_cast<Index>(high * (high - 1) / 2 + low));
  };
  CHECK(cosine(0, candidates.size() - 1) == Approx(1).epsilon(1e-9));
  const auto index = [&](const EffectId& effect) {
    const auto found = std::find_if(candidates.begin(), candidates.end(), [&](const EffectCandidate& candidate) {
      return candidate.label().effect == effect;
    });
    return static_cast<std::size_t>(found - candidates.begin());
  };
  // What an asymmetric damper does is even, friction is odd.
  CHECK(std::abs(cosine(index("damper_asymmetry"), index("coulomb_friction"))) < 0.3);
}

TEST_CASE("what a sensor tells is the same however little memory there is, in one pass over the sensors or in many") {
  const Plant plant = plant_from(quarter_car_text);
  const std::vector<FitRecord> records = drive_of(plant, 0.004, 4, 4);
  const std::vector<EffectCandidate> candidates = some_of(plant, {"damper_asymmetry", "sensor_lag"});
  const std::vector<CandidatePair> pairs = all_pairs(candidates.size());
  const auto products_in = [&](double bytes, const std::vector<CandidatePair>& wanted, Index first = 0) {
    std::vector<Products> products;
    const Responses r = responses(plant, candidates, {}, records, {first, wanted, bytes},
                                  [&](const Responses&, Index, const Products& seen) { products.push_back(seen); });
    REQUIRE(r.status == Status::ok);
    return products;
  };
  const std::vector<Products> one = products_in(1e9, pairs), many = products_in(1, pairs);
  REQUIRE(one.size() == plant.sensors.size());
  REQUIRE(many.size() == one.size());
  for (std::size_t s = 0; s < one.size(); ++s) {
    CHECK(one[s].tangents == many[s].tangents);
    CHECK(one[s].squares == many[s].squares);
    CHECK(one[s].pairs == many[s].pairs);
    CHECK(one[s].squares.minCoeff() >= 0);
    CHECK(one[s].squares.norm() > 0);
    for (std::size_t k = 0; k < pairs.size(); ++k) {
      const double most = std::sqrt(one[s].squares(pairs[k][0]) * one[s].squares(pairs[k][1]));
      CHECK(std::abs(one[s].pairs(static_cast<Index>(k))) <= most * (1 + 1e-9));
    }
  }
  // A pair's product does not depend on the pairs that are asked for beside it, nor on the sensors before its own.
  const std::vector<Products> few = products_in(1e9, {pairs.back()}, 1);
  REQUIRE(few.size() + 1 == one.size());
  for (std::size_t s = 0; s < few.size(); ++s) {
    CHECK(few[s].tangents == one[s + 1].tangents);
    CHECK(few[s].pairs(0) == one[s + 1].pairs(one[s + 1].pairs.size() - 1));
  }
}

TEST_CASE("copies of a candidate have its products, in whichever block of columns they stand") {
  const Plant plant = plant_from(quarter_car_text);
  const std::vector<FitRecord> records = drive_of(plant, 0.004, 4, 1);
  const std::vector<EffectCandidate> few = some_of(plant, {"damper_asymmetry", "coulomb_friction", "sensor_lag"});
  std::vector<EffectCandidate> copies;
  while (copies.size() < 600) copies.insert(copies.end(), few.begin(), few.end());
  const std::vector<CandidatePair> pairs = all_pairs(copies.size());
  responses(plant, copies, {}, records, {.pairs = pairs}, [&](const Responses&, Index sensor, const Products& seen) {
    CAPTURE(sensor);
    double worst = 0;
    for (std::size_t k = 0; k < pairs.size(); ++k) {
      const std::size_t a = pairs[k][0] % few.size(), b = pairs[k][1] % few.size();
      const auto [low, high] = std::minmax(a, b);
      const double first =
          a == b ? seen.squares(static_cast<Index>(a)) : seen.pairs(static_cast<Index>(high * (high - 1) / 2 + low));
      const double scale = std::sqrt(seen.squares(static_cast<Index>(a)) * seen.squares(static_cast<Index>(b)));
      worst = std::max(worst, std::abs(seen.pairs(static_cast<Index>(k)) - first) / scale);
    }
    CHECK(worst < 1e-9);
    const Index tangents = seen.tangents.rows(), count = static_cast<Index>(few.size());
    const auto last = static_cast<Index>(copies.size()) - count;
    CHECK((seen.tangents.middleCols(tangents, count) - seen.tangents.middleCols(tangents + last, count)).norm() <=
          1e-9 * seen.tangents.middleCols(tangents, count).norm());
  });
}

TEST_CASE("friction grows against the response as the level falls") {
  const Plant plant = plant_from(quarter_car_text);
  const std::vector<EffectCandidate> friction = some_of(plant, {"coulomb_friction"});
  std::vector<FitRecord> high = drive_of(plant, 0.006, 4, 6), low = high;
  low[0].drive *= 0.5;
  low[0].weight_std *= 0.5;  // in proportion to the response
  CHECK(seen_with(plant, friction, low).size(0) > 1.2 * seen_with(plant, friction, high).size(0));
}

TEST_CASE("a delay and an actuator's lag look alike below 20 Hz, a band further up tells them better") {
  const Plant plant = plant_from(quarter_car_text);
  const std::vector<FitRecord> records = drive_of(plant, 0.004, 6, 8);
  std::vector<EffectCandidate> all = some_of(plant, {"time_delay", "actuator_lag", "damper_asymmetry", "tyre_liftoff"});
  std::erase_if(all, [](const EffectCandidate& candidate) { return candidate.location.kind == PlaceKind::sensor; });
  std::vector<std::string> steps;
  const Plan plan = plan_test(plant, records, 2, all, {}, [&](const std::string& what) { steps.push_back(what); });
  REQUIRE(plan.status == Status::ok);
  REQUIRE(plan.planned.effects.size() == 4);
  REQUIRE(plan.pairs.size() == 1);
  const PlanPair& pair = plan.pairs[0];
  CHECK(std::abs(pair.cosine) > confused_cosine);
  for (const std::size_t i : {pair.a, pair.b}) CHECK(plan.planned.effects[i].location == "actuator"_at);
  REQUIRE(pair.item >= 0);
  const PlanItem& item = plan.menu[static_cast<std::size_t>(pair.item)];
  CHECK_THAT(item.view.name, Catch::Contains("noise up to"));
  CHECK(std::abs(pair.item_cosine) < std::abs(pair.cosine));
  CHECK(steps.size() >= 7);

  // Of the whole menu: repeats make every effect larger by the root of their number and change no direction.
  const auto repeats = std::find_if(plan.menu.begin(), plan.menu.end(), [](const PlanItem& candidate) {
    return candidate.view.name.find("4 repeats") != std::string::npos;
  });
  REQUIRE(repeats != plan.menu.end());
  CHECK(repeats->view.effects[0].size_sigma ==
        Approx(std::sqrt(2.0) * plan.planned.effects[0].size_sigma).epsilon(0.05));

  std::vector<EffectCandidate> two;
  for (const EffectCandidate& candidate : all)
    if (candidate.location == "actuator"_at && candidate.label().form != "second order") two.push_back(candidate);
  REQUIRE(two.size() == 2);
  const SeparatingTest test = separating_test(plant, records, two[0], two[1]);
  CHECK(std::abs(test.planned_cosine) > confused_cosine);
  CHECK(std::abs(test.cosine) < std::abs(test.planned_cosine));
  CHECK_THAT(test.test, Catch::Contains("noise up to"));
}

TEST_CASE("a plan is made for any graph: one mass under a force, a chain with two inputs", "[slow]") {
  for (const std::string& text : {one_mass_text, chain_text}) {
    const Plant plant = plant_from(text);
    CAPTURE(plant.name);
    const double level = plant.input_count() == 1 ? 1 : 0.002;
    const Plan plan = plan_test(plant, drive_of(plant, level, 3, 4), 1, all_of(plant, drive_of(plant, level, 3, 4)));
    INFO(plan.message);
    REQUIRE(plan.status == Status::ok);
    CHECK(plan.planned.effects.size() > 10);
    CHECK(plan.menu.size() >= 5);
    CHECK(std::any_of(plan.planned.effects.begin(), plan.planned.effects.end(),
                      [](const PlannedEffect& effect) { return effect.size_sigma >= visible_sigma; }));
    const bool several =
        std::any_of(plan.planned.effects.begin(), plan.planned.effects.end(),
                    [](const PlannedEffect& effect) { return effect.location == "actuator:motor"_at; });
    CHECK(several == (plant.input_count() > 1));
  }
}

TEST_CASE(
    "a drive that the plant cannot follow is said to be one, a stronger one of the menu is left with its reason") {
  const Plant plant = plant_from(quarter_car_text);
  std::vector<FitRecord> records = drive_of(plant, 0.004, 4, 4);
  const std::vector<EffectCandidate> candidates = some_of(plant, {"damper_asymmetry"});
  records[0].drive *= 14;
  const Plan strong = plan_test(plant, records, 1, candidates);
  REQUIRE(strong.status == Status::ok);
  CHECK_FALSE(strong.menu.back().view.message.empty());
  records[0].drive *= 20;
  const Plan beyond = plan_test(plant, records, 1, candidates);
  CHECK(beyond.status == Status::outside_domain);
  CHECK_THAT(beyond.message, Catch::Contains("suspension"));
}
