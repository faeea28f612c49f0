// Where a gap enters, without a catalogue: the place of an unknown force leaves the noise, every other place more.
#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <set>

#include "core/gap/diagnose.hpp"
#include "core/gap/verdict/posterior.hpp"
#include "core/gap/where/locate.hpp"
#include "core/plant/dataset.hpp"
#include "tests/support/places.hpp"
#include "tests/support/plants.hpp"
#include "tests/support/systems.hpp"
#include "variants/solver/levenberg_marquardt.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

namespace {

/// A record of a truth with noise of 1 % (white, or that of a first-order filter) and a plant fitted to it.
struct Seen {
  std::vector<FitRecord> records;
  PlantFit fit;
  Matrix noise_shares;
};

Seen seen(const Plant& nominal, const Plant& truth, double memory = 0) {
  const Index samples = 3000, ratio = 5, bands = 40;
  Random random = numbers(621);
  FitRecord record;
  record.drive.resize(nominal.input_count(), samples * ratio);
  Matrix poles = Matrix::Zero(nominal.input_count(), 4);
  for (Index k = 0; k < record.drive.cols(); ++k)
    for (Index i = 0; i < nominal.input_count(); ++i) {
      double value = random.normal();
      for (Index stage = 0; stage < 4; ++stage) value = poles(i, stage) += 0.06 * (value - poles(i, stage));
      record.drive(i, k) = 0.004 * value;  // a travel in which the spring is nearly linear
    }
  record.ratio = ratio;
  const GeneratedRecord made = generate_record(truth, record.drive, 200);
  REQUIRE(made.status == Status::ok);
  record.weight_std = 0.01 * made.signal.y.rowwise().norm() / std::sqrt(static_cast<double>(samples));
  Matrix noise = random.normal(made.signal.y.rows(), samples);
  for (Index k = 1; k < samples; ++k)
    noise.col(k) = memory * noise.col(k - 1) + std::sqrt(1 - memory * memory) * noise.col(k);
  record.y = made.signal.y + record.weight_std.asDiagonal() * noise;
  Seen result;
  result.records = {record};
  result.fit = fit_plant(nominal, {}, result.records, *make_levenberg_marquardt({}), {6});
  REQUIRE(result.fit.error.size() == 1);
  if (memory == 0) return result;
  result.noise_shares.resize(noise.rows(), bands);
  for (Index b = 0; b < bands; ++b) {
    const double w = std::acos(-1.0) * (static_cast<double>(b) + 0.5) / static_cast<double>(bands);
    result.noise_shares.col(b).setConstant((1 - memory * memory) / (1 + memory * memory - 2 * memory * std::cos(w)));
  }
  result.noise_shares /= result.noise_shares.row(0).sum();
  return result;
}

/// What a diagnosis without any catalogue makes of two repeats and a validation record of a truth.
Diagnosis without_catalogue(const Plant& nominal, const Plant& truth) {
  RecordSet set;
  set.sampling_hz = 200;
  const Seen own = seen(nominal, truth);
  Random random = numbers(622);
  for (int which = 0; which < 3; ++which) {
    Matrix drive = own.records.front().drive;
    if (which == 2) drive.rowwise().reverseInPlace();
    Record record{"r" + std::to_string(which) + ".csv", which < 2 ? "estimation" : "validation",
                  which < 2 ? "drive" : "", 0, generate_record(truth, drive, 200).signal};
    record.signal.y += own.records.front().weight_std.asDiagonal() * random.normal(record.signal.y.rows(), 3000);
    set.records.push_back(std::move(record));
  }
  const auto solver = make_levenberg_marquardt({});
  const auto nothing = [](const Plant&, const Operation&) { return std::vector<EffectCandidate>{}; };
  return diagnose(nominal, set, nothing, {*solver, *solver, *solver}, {}, 622);
}

std::vector<PlaceLeftover> places_of(const Plant& nominal, const Plant& truth) {
  const Seen own = seen(nominal, truth);
  return locate(own.fit, own.records);
}

}  // namespace

TEST_CASE("Lemma 3: a force missing between two masses, at the tyre or in a sensor is found at its own place") {
  const Plant nominal = plant_from(quarter_car_text);
  {
    Plant truth = nominal;
    truth.elements[0].laws.push_back({find_law("asymmetric_damper"), {850, 0.3, 0.1, 1, 1}});
    const std::vector<PlaceLeftover> places = places_of(nominal, truth);
    REQUIRE(places.size() >= 5);
    CHECK(places[0].location == "suspension"_at);
    CHECK(places[0].leftover < 3);  // 1, and what linearising and holding the force over a sample leave
    CHECK(places[1].leftover > 2 * places[0].leftover);
  }
  {
    Plant truth = nominal;
    set_parameter(truth, "actuator:road.gain", 1.08);
    const std::vector<PlaceLeftover> places = places_of(nominal, truth);
    CHECK(places[0].location == "tyre"_at);
    CHECK(places[1].leftover > 2 * places[0].leftover);
    // The record cannot tell a tyre from what drives it, nor from the ground under the wheel.
    CHECK(std::find(places[0].same.begin(), places[0].same.end(), "actuator"_at) != places[0].same.end());
    CHECK(std::find(places[0].same.begin(), places[0].same.end(), "guide:wheel"_at) != places[0].same.end());
  }
  Plant truth = nominal;
  set_parameter(truth, "sensor:body_acc.gain", 1.1);
  const std::vector<PlaceLeftover> places = places_of(nominal, truth);
  CHECK(places[0].location == "sensor:body_acc"_at);
  CHECK(places[0].leftover == Approx(1).epsilon(0.2));
}

TEST_CASE("a law that is missing in an element is found there where a sensor reads its force") {
  Plant nominal = plant_from(quarter_car_text);
  nominal.sensors.push_back({"cell", SensorKind::force, "", "", "N", {}, "suspension"});
  Plant truth = nominal;
  truth.elements[0].laws.push_back({find_law("asymmetric_damper"), {850, 0.3, 0.1, 1, 1}});
  const std::vector<PlaceLeftover> places = places_of(nominal, truth);
  CHECK(places[0].location == "suspension"_at);
  CHECK(places[0].leftover < 3);
  CHECK(places[1].leftover > 2 * places[0].leftover);
}

TEST_CASE("an effect at a guide is compared with the guide's place, one on a mass with that of its guide") {
  const std::vector<PlaceLeftover> places = {
      {"suspension"_at, {}, 1.5}, {"tyre"_at, {"guide:wheel"_at}, 3}, {"guide:body"_at, {}, 6}};
  CHECK(leftover_ratio(places, "suspension"_at) == 1);
  CHECK(leftover_ratio(places, "guide:wheel"_at) == Approx(2));
  CHECK(leftover_ratio(places, "wheel"_at) == Approx(2));
  CHECK(leftover_ratio(places, "guide:body"_at) == Approx(4));
  // Below the noise there is nothing to tell places apart.
  const std::vector<PlaceLeftover> few = {{"suspension"_at, {}, 0.02}, {"tyre"_at, {}, 0.13}, {"guide:body"_at, {}, 3}};
  CHECK(leftover_ratio(few, "tyre"_at) == 1);
  CHECK(leftover_ratio(few, "guide:body"_at) == Approx(3));
  // An element that stands for a guide has the guide's name, once.
  Plant guided = plant_from(quarter_car_text);
  guided.elements.push_back({guide_element("body"), "ground", "body", {{find_law("viscous_damper"), {20}}}});
  int named = 0;
  for (const PlaceLeftover& place : places_of(guided, guided)) {
    CHECK(place.location != part_place(guide_element("body")));
    named += place.location == "guide:body"_at;
    named += static_cast<int>(std::count(place.same.begin(), place.same.end(), "guide:body"_at));
  }
  CHECK(named == 1);
}

TEST_CASE("in a chain of three masses the element is found among its neighbours") {
  const Plant nominal = plant_from(chain_text);
  for (std::size_t e = 0; e < nominal.elements.size(); ++e) {
    Plant truth = nominal;
    truth.elements[e].laws.push_back({find_law("viscous_damper"), {6}});
    const std::vector<PlaceLeftover> places = places_of(nominal, truth);
    CAPTURE(nominal.elements[e].name, places[0].location, places[0].leftover, places[1].location);
    CHECK(places[0].location == part_place(nominal.elements[e].name));
  }
}

TEST_CASE("coloured noise counts as what it is in the band: the right place leaves 1") {
  const Plant nominal = plant_from(quarter_car_text);
  Plant truth = nominal;
  set_parameter(truth, "sensor:body_acc.gain", 1.1);
  const Seen own = seen(nominal, truth, 0.8);
  CHECK(locate(own.fit, own.records).front().leftover > 2);
  const std::vector<PlaceLeftover> places = locate(own.fit, own.records, own.noise_shares);
  CHECK(places.front().location == "sensor:body_acc"_at);
  CHECK(places.front().leftover == Approx(1).epsilon(0.2));
  CHECK(explains_all(places.front().leftover, own.fit.misfit));
}

TEST_CASE("two unknown signals are found at their two places, where no single one explains all") {
  const Plant nominal = plant_from(quarter_car_text);
  Plant truth = nominal;
  set_parameter(truth, "sensor:body_acc.gain", 1.1);
  set_parameter(truth, "actuator:road.gain", 1.08);
  const Seen own = seen(nominal, truth);
  const std::vector<PlaceLeftover> places = locate(own.fit, own.records);
  CHECK_FALSE(explains_all(places.front().leftover, own.fit.misfit));
  const std::vector<PairLeftover> pairs = locate_two(own.fit, own.records, places);
  REQUIRE(pairs.size() == places.size() * (places.size() - 1) / 2);
  std::array<Place, 2> best = pairs.front().locations;
  std::sort(best.begin(), best.end());
  CHECK(best == std::array<Place, 2>{"sensor:body_acc"_at, "tyre"_at});
  CHECK(explains_all(pairs.front().leftover, own.fit.misfit));
  CHECK(pairs[1].leftover > 1.2 * pairs[0].leftover);
  // A second place takes away, with its freedom in the noise: no pair leaves more than either of its places.
  for (const PairLeftover& pair : pairs)
    for (const PlaceLeftover& place : places)
      if (place.location == pair.locations[0] || place.location == pair.locations[1])
        CHECK(pair.leftover < 2.1 * place.leftover);  // chi2 falls, and is over one channel in place of two
}

TEST_CASE("with two channels any two places explain all: no pairs are told") {
  Plant nominal = plant_from(quarter_car_text);
  nominal.sensors.pop_back();
  Plant truth = nominal;
  set_parameter(truth, "actuator:road.gain", 1.08);
  const Seen own = seen(nominal, truth);
  const std::vector<PlaceLeftover> places = locate(own.fit, own.records);
  CHECK_FALSE(places.empty());
  CHECK(locate_two(own.fit, own.records, places).empty());
}

TEST_CASE("without any catalogue one fault is an unknown at its place, two are at theirs, three are not locatable",
          "[slow]") {
  const Plant nominal = plant_from(quarter_car_text);
  Plant truth = nominal;
  truth.sensors[0].path.lag.time_constant_s = 0.006;  // what no parameter does
  const Diagnosis one = without_catalogue(nominal, truth);
  CHECK(one.evidence.places_needed == 1);
  CHECK(one.evidence.place_pairs.empty());
  CHECK(one.verdict.named == std::vector<EffectAt>{"unknown@sensor:travel"_effect});
  truth.elements[0].laws.push_back({find_law("asymmetric_damper"), {850, 0.4, 0.1, 1, 1}});
  const Diagnosis two = without_catalogue(nominal, truth);
  CHECK(is<AtTwoPlaces>(two.verdict));
  CHECK(two.evidence.places_needed == 2);
  CHECK(std::set<EffectAt>(two.verdict.named.begin(), two.verdict.named.end()) ==
        std::set<EffectAt>{"unknown@sensor:travel"_effect, "unknown@suspension"_effect});
  CHECK(two.verdict.named.front() == EffectAt{"unknown", two.verdict.locations[0].location});
  CHECK(two.verdict.named.back() == EffectAt{"unknown", two.verdict.locations[1].location});
  CHECK(two.verdict.locations[1].probability > 0.9);
  truth.sensors[1].path.lag.time_constant_s = 0.006;
  const Diagnosis three = without_catalogue(nominal, truth);
  CHECK(three.evidence.places_needed == 0);
  CHECK(three.verdict.named.size() == 1);
  CHECK(three.verdict.locations.front().probability <= 0.5);
  CHECK_THAT(three.verdict.message, Catch::Contains("the place is in doubt"));
}
