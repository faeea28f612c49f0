// The unknown signal at a place is the force that was put there, with the sign of a law.
#include <catch2/catch.hpp>
#include <cmath>

#include "core/data/resample.hpp"
#include "core/gap/where/locate.hpp"
#include "core/gap/where/unknown.hpp"
#include "core/greybox/trajectory.hpp"
#include "core/plant/dataset.hpp"
#include "tests/support/places.hpp"
#include "tests/support/plants.hpp"
#include "tests/support/systems.hpp"
#include "variants/solver/levenberg_marquardt.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

namespace {

constexpr Index kSampled = 3000, kRatio = 5;

Matrix smooth(Index rows, double size, Random& random) {
  Matrix out(rows, kSampled * kRatio), poles = Matrix::Zero(rows, 4);
  for (Index k = 0; k < out.cols(); ++k)
    for (Index i = 0; i < rows; ++i) {
      double value = random.normal();
      for (Index stage = 0; stage < 4; ++stage) value = poles(i, stage) += 0.06 * (value - poles(i, stage));
      out(i, k) = size * value;
    }
  return out;
}

/// The plant without what moved the record that `truth` made, fitted to it.
struct Run {
  PlantFit fit;
  std::vector<FitRecord> records;
  Run(const Plant& nominal, const Plant& truth, const Matrix& drive, double noise) {
    const GeneratedRecord made = generate_record(truth, drive, 200);
    REQUIRE(made.status == Status::ok);
    Random random = numbers(831);
    const Vector floor = noise * made.signal.y.rowwise().norm() / std::sqrt(static_cast<double>(kSampled));
    records.push_back({drive.topRows(nominal.input_count()), made.signal.y, kRatio, 0, floor, {}});
    records[0].y += floor.asDiagonal() * random.normal(floor.size(), kSampled);
    fit = fit_plant(nominal, {}, records, *make_levenberg_marquardt({}), {6});
    REQUIRE(fit.error.size() == 1);
  }
  Vector at(const Place& place) const {
    const UnknownSignal found = unknown_signal(fit, records, 0, place);
    CAPTURE(found.message);
    REQUIRE(found.status == Status::ok);
    CHECK(found.value.size() == kSampled);
    CHECK(found.rms == Approx(found.value.norm() / std::sqrt(static_cast<double>(kSampled))));
    CHECK(found.noise_rms < found.rms);
    return found.value;
  }
};

Vector inner(const Vector& x) { return x.segment(200, kSampled - 400); }

}  // namespace

TEST_CASE("a force between two masses, or on one, is reconstructed: a law's sign is minus that of a force input",
          "[slow]") {
  const Plant nominal = plant_from(chain_text);
  for (const Place& place : {"lower"_at, "upper"_at, "foot"_at, "guide:mid"_at}) {
    CAPTURE(place);
    Plant truth = nominal;
    PlantInput force{
        .name = "hidden", .kind = InputKind::force, .unit = "N", .hold_hz = 1000, .from = "ground", .to = "mid"};
    if (place == "lower"_at) force.from = "low";
    if (place == "upper"_at)
      force = {.name = "hidden", .kind = InputKind::force, .unit = "N", .hold_hz = 1000, .from = "mid", .to = "top"};
    if (place == "foot"_at) force.to = "low";
    truth.inputs.push_back(force);
    Random random = numbers(832);
    Matrix drive = smooth(3, 1, random);
    drive.row(0) *= 0.004;
    const Vector hidden = decimate(drive.row(2), kRatio).transpose();
    const Run run(nominal, truth, drive, 0.002);
    // What holds the two lower plates together hardly moves any of these sensors.
    CHECK(relative_error(inner(run.at(place)), inner(-hidden)) < (place == "lower"_at ? 0.35 : 0.1));
  }
}

TEST_CASE("a missing damper reads its coefficient times the rate of its element") {
  const Plant nominal = plant_from(quarter_car_text);
  Plant truth = nominal;
  truth.elements[0].laws.push_back({find_law("viscous_damper"), {120}});
  Random random = numbers(833);
  const Run run(nominal, truth, smooth(1, 0.003, random), 0.005);
  const Vector force = inner(run.at("suspension"_at));
  // Its own rate, that of the plant with the damper.
  PlantFit true_fit = fit_plant(truth, {}, run.records, *make_levenberg_marquardt({}), {6});
  const Vector rate = inner(trajectories(true_fit, run.records)[0].rate.row(0).transpose());
  CHECK(force.dot(rate) / rate.squaredNorm() == Approx(120).epsilon(0.1));
  CHECK(force.dot(rate) / force.norm() / rate.norm() > 0.97);
}

TEST_CASE(
    "a sensor's unknown is measured minus simulated, a place that the plant has not is refused, noise is no force") {
  const Plant nominal = plant_from(quarter_car_text);
  Plant truth = nominal;
  set_parameter(truth, "sensor:body_acc.gain", 1.1);
  Random random = numbers(834);
  const Run run(nominal, truth, smooth(1, 0.003, random), 0.005);
  CHECK(relative_error(run.at("sensor:body_acc"_at), 0.1 / 1.1 * run.records[0].y.row(1).transpose()) < 0.1);
  CHECK(unknown_signal(run.fit, run.records, 0, "sensor:body_acc"_at).unit == "m/s^2");
  CHECK(unknown_signal(run.fit, run.records, 0, "timebase"_at).status == Status::unavailable);
  const Run quiet(nominal, nominal, smooth(1, 0.003, random), 0.01);
  const UnknownSignal nothing = unknown_signal(quiet.fit, quiet.records, 0, "suspension"_at);
  CHECK(nothing.rms < 2 * nothing.noise_rms + 1);
}

TEST_CASE("the plant's own states explain a law that is missing, whatever its form, and no force from outside",
          "[slow]") {
  const Plant nominal = plant_from(quarter_car_text);
  Random random = numbers(833);
  const Matrix drive = 0.004 * smooth(1, 1, random);
  Plant missing = nominal;
  missing.elements[0].laws.push_back({find_law("asymmetric_damper"), {850, 0.4, 0.1, 1, 1}});
  const Run own(nominal, missing, drive, 0.01);
  CHECK(explained_by_states(own.fit, own.records, "suspension"_at) > 0.7);

  // Of places that enter alike, the one whose own motion a law reads explains it best.
  Plant dragged = nominal, tyre = nominal;
  dragged.elements.push_back({"drag", "ground", "wheel", {{find_law("coulomb_friction"), {40, 40, 0.1, 0.01}}}});
  tyre.elements[1].laws.push_back({find_law("polynomial_spring"), {0, 0, 4e9}});
  const Run held(nominal, dragged, drive, 0.002), hard(nominal, tyre, drive, 0.002);
  const auto share = [](const Run& run, const Place& entry) {
    return explained_by_states(run.fit, run.records, "tyre"_at, entry);
  };
  CHECK(share(held, "guide:wheel"_at) > share(held, "tyre"_at) + 0.1);
  CHECK(share(hard, "tyre"_at) > share(hard, "guide:wheel"_at) + 0.1);
  CHECK(share(hard, "tyre"_at) > share(hard, "actuator"_at) + 0.1);

  Plant pushed = nominal;
  pushed.inputs.push_back(
      {.name = "hidden", .kind = InputKind::force, .unit = "N", .hold_hz = 1000, .from = "ground", .to = "body"});
  Matrix both(2, drive.cols());
  both << drive, 40 * smooth(1, 1, random);
  const Run outside(nominal, pushed, both, 0.01);
  CHECK(explained_by_states(outside.fit, outside.records, "guide:body"_at) < 0.3);
  CHECK(std::isnan(explained_by_states(outside.fit, outside.records, "nowhere"_at)));
}

TEST_CASE("a stop that is met at the peaks alone is the element's own doing", "[slow]") {
  const Plant nominal = plant_from(quarter_car_text);
  Random random = numbers(835);
  const Matrix drive = 0.004 * smooth(1, 1, random);
  const Run still(nominal, nominal, drive, 0.01);
  const Trajectory motion = trajectories(still.fit, still.records)[0];
  for (const Index element : {0, 1}) {
    const Place place = part_place(nominal.elements[static_cast<std::size_t>(element)].name);
    const auto travel = motion.travel.row(element);
    const double gap = 2.2 * travel.norm() / std::sqrt(static_cast<double>(kSampled));
    Plant stopped = nominal;
    stopped.elements[static_cast<std::size_t>(element)].laws.push_back({find_law("bump_stop"), {gap, 1, 4e4, 1}});
    const Run run(nominal, stopped, drive, 0.01);
    CAPTURE(place, gap);
    CHECK(explained_by_states(run.fit, run.records, place, place) > 0.4);
    CHECK(explained_by_states(run.fit, run.records, place) > 0.4);
  }
}

TEST_CASE("a stiffness that changes with time reads its own travel, as slowly or fast as it may change", "[slow]") {
  const Plant nominal = plant_from(quarter_car_text);
  Random random = numbers(834);
  const Matrix drive = 0.004 * smooth(1, 1, random);
  const Run still(nominal, nominal, drive, 0.01);
  const Eigen::RowVectorXd travel = trajectories(still.fit, still.records)[0].travel.row(0);
  Plant pushed = nominal;
  pushed.inputs.push_back(
      {.name = "hidden", .kind = InputKind::force, .unit = "N", .hold_hz = 1000, .from = "wheel", .to = "body"});
  for (const double changes_hz : {0.3, 1.0, 2.5}) {
    CAPTURE(changes_hz);
    Matrix both(2, drive.cols());
    for (Index k = 0; k < drive.cols(); ++k) {
      both(0, k) = drive(0, k);
      both(1, k) = -6000 * std::sin(6.2832 * changes_hz * static_cast<double>(k) / 1000) * travel(k / kRatio);
    }
    const Run changing(nominal, pushed, both, 0.01);
    CHECK(explained_by_states(changing.fit, changing.records, "suspension"_at, "suspension"_at) > 0.4);
  }
}

TEST_CASE("a force that follows the motion a little is told from one that does not at all", "[slow]") {
  const Plant nominal = plant_from(quarter_car_text);
  Random random = numbers(836);
  const Matrix drive = 0.004 * smooth(1, 1, random);
  const Run still(nominal, nominal, drive, 0.01);
  const Eigen::RowVectorXd speed = trajectories(still.fit, still.records)[0].velocity.row(0);
  const double size = speed.norm() / std::sqrt(static_cast<double>(kSampled));
  Plant pushed = nominal;
  pushed.inputs.push_back(
      {.name = "hidden", .kind = InputKind::force, .unit = "N", .hold_hz = 1000, .from = "ground", .to = "body"});
  for (int trial = 0; trial < 4; ++trial) {
    const Vector other = random.normal(kSampled, 1);
    for (const double follows : {0.0, 0.5}) {
      CAPTURE(trial, follows);
      Matrix both(2, drive.cols());
      both.row(0) = drive;
      for (Index k = 0; k < drive.cols(); ++k)
        both(1, k) = 40 * (other(k / kRatio) - follows * speed(k / kRatio) / size);
      const Run run(nominal, pushed, both, 0.01);
      const double share = explained_by_states(run.fit, run.records, "guide:body"_at);
      if (follows == 0)
        CHECK(share == 0);
      else {
        CHECK(share > 0);
        CHECK(share < 0.3);
      }
    }
  }
}
