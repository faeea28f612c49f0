// How far a gap could shrink at a place: a static map reaches what any signal does where the missing law has no memory.
#include <catch2/catch.hpp>
#include <cmath>

#include "core/gap/study/ceiling.hpp"
#include "core/gap/where/forced.hpp"
#include "core/gap/which/hypothesis.hpp"
#include "core/plant/dataset.hpp"
#include "tests/support/places.hpp"
#include "tests/support/plants.hpp"
#include "tests/support/systems.hpp"
#include "variants/nonlinearity/mlp.hpp"
#include "variants/solver/levenberg_marquardt.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

namespace {

constexpr Index kSamplesEach = 4000;

/// Two records of `truth`, one to train on, and the nominal plant's fit of the other.
struct Rig {
  GapData data;
  PlantFit before;
  Rig(const Plant& nominal, const Plant& truth) {
    Random random = numbers(861);
    RecordSet set;
    set.sampling_hz = 200;
    for (const char* role : {"estimation", "validation"}) {
      Matrix drive(1, 5 * kSamplesEach);
      Vector poles = Vector::Zero(4);
      for (double& value : drive.reshaped()) {
        value = 0.006 * random.normal();
        for (double& pole : poles) value = pole += 0.06 * (value - pole);
      }
      const GeneratedRecord made = generate_record(truth, drive, 200);
      REQUIRE(made.status == Status::ok);
      set.records.push_back({role, role, "", 0, made.signal});
      Matrix& y = set.records.back().signal.y;
      const Vector noise = 0.01 * y.rowwise().norm() / std::sqrt(static_cast<double>(kSamplesEach));
      if (set.noise_std.empty())
        for (Index i = 0; i < y.rows(); ++i)
          set.noise_std[nominal.sensors[static_cast<std::size_t>(i)].name] = noise(i);
      y += noise.asDiagonal() * random.normal(y.rows(), kSamplesEach);
    }
    data = gap_data(nominal, set, noise_floor(set), 2);
    before = fit_plant(nominal, {}, data.held_out, *make_levenberg_marquardt({}), {12});
    REQUIRE(before.misfit > 3);
  }
  Ceiling at(const Plant& bare, const Place& place) const {
    Random random = numbers(862);
    const auto map = make_mlp(2, 1, {});
    const auto solver = make_levenberg_marquardt({});
    return ceiling_at({bare}, data.fitted, data.held_out, place, before, {*map, *solver, *solver},
                      {.band_edges_hz = {0, 100}, .noise_shares = {}}, random);
  }
};

Plant with(const Plant& nominal, const char* law, std::vector<double> values) {
  Plant plant = nominal;
  plant.elements[0].laws.push_back({find_law(law), std::move(values)});
  return plant;
}

}  // namespace

TEST_CASE("where a law without memory is missing, a static map removes nearly what any signal at its place does",
          "[slow]") {
  const Plant nominal = plant_from(quarter_car_text);
  for (const Plant& truth :
       {with(nominal, "asymmetric_damper", {850, 0.3, 0.1, 1, 1}), with(nominal, "polynomial_spring", {0, 0, 2e9}),
        with(nominal, "coulomb_friction", {40, 0, 0.01, 0.01})}) {
    CAPTURE(truth.elements[0].laws.back().kind->name);
    const Rig rig(nominal, truth);
    const Ceiling ceiling = rig.at(nominal, "suspension"_at);
    CAPTURE(ceiling.why_not, rig.before.misfit);
    REQUIRE(ceiling.why_not.empty());
    CHECK(ceiling.signal > 0.95);
    CHECK(ceiling.signal < 1.02);
    CHECK(ceiling.static_map > ceiling.signal - 0.05);
    CHECK(ceiling.static_map < ceiling.signal + 0.02);
  }
}

TEST_CASE("where a law with memory is missing, or the drive is late, a static map stays clearly behind any signal",
          "[slow]") {
  const Plant nominal = plant_from(quarter_car_text);
  Plant late = nominal;
  set_parameter(late, "actuator:road.delay_s", 0.012);
  const Plant hysteretic = with(nominal, "bouc_wen", {60, 0.0006, 1, 0.5, 0, 0, 0.05});
  for (const auto& [truth, place] : {std::pair{hysteretic, "suspension"_at}, {late, "tyre"_at}}) {
    CAPTURE(place);
    const Rig rig(nominal, truth);
    const Ceiling ceiling = rig.at(nominal, place);
    CAPTURE(ceiling.why_not, rig.before.misfit);
    REQUIRE(ceiling.why_not.empty());
    CHECK(ceiling.signal > 0.95);
    CHECK(ceiling.static_map < ceiling.signal - 0.15);
  }
}

TEST_CASE("the map's force with its sign flipped makes the gap larger, no force leaves it, and so do wrong places",
          "[slow]") {
  const Plant nominal = plant_from(quarter_car_text);
  const Rig rig(nominal, with(nominal, "asymmetric_damper", {850, 0.3, 0.1, 1, 1}));
  const Ceiling right = rig.at(nominal, "suspension"_at), wrong = rig.at(nominal, "tyre"_at);
  REQUIRE(right.mapped.size() == 1);
  const auto misfit = [&](double factor) {
    return inner_misfit(
        residuals(force_at(rig.before, rig.data.held_out, "suspension"_at, {factor * right.mapped[0]})));
  };
  const double gap = misfit(0) - 1;
  CHECK(misfit(0) == Approx(rig.before.misfit).epsilon(0.1));
  CHECK(1 - (misfit(1) - 1) / gap == Approx(right.static_map).epsilon(1e-3));
  CHECK(1 - (misfit(-1) - 1) / gap < -2);
  CHECK(wrong.signal < right.signal - 0.1);
  CHECK(wrong.static_map < right.static_map - 0.3);
}

TEST_CASE("a sensor or the time base has no motion to map, and says so") {
  const Plant nominal = plant_from(quarter_car_text);
  const Rig rig(nominal, with(nominal, "asymmetric_damper", {850, 0.3, 0.1, 1, 1}));
  for (const Place& place : {"sensor:body_acc"_at, clock_place(), "nowhere"_at}) {
    const Ceiling none = rig.at(nominal, place);
    CHECK(none.location == place);
    CHECK_FALSE(none.why_not.empty());
  }
}
