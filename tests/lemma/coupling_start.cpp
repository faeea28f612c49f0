// What AC coupling had stored before a record began is found, however the record begins.
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/data/metrics.hpp"
#include "core/greybox/inner_states.hpp"
#include "core/greybox/plant_fit.hpp"
#include "core/plant/dataset.hpp"
#include "tests/support/plants.hpp"
#include "tests/support/systems.hpp"
#include "variants/solver/levenberg_marquardt.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

namespace {

constexpr double kSamplingHz = 200, kNoise = 0.01;

/// A quarter car whose first sensor is coupled.
Plant coupled_car(double corner_hz) {
  Plant plant = plant_from(quarter_car_text);
  plant.sensors[0].path.high_pass_hz = corner_hz;
  return plant;
}

/// The seconds of a run from `from_s` on.
FitRecord cut_record(const Plant& truth, double from_s, double seconds, Random& random) {
  const Index ratio = hold_samples_per_record_sample(truth, kSamplingHz);
  const auto first = static_cast<Index>(from_s * kSamplingHz), samples = static_cast<Index>(seconds * kSamplingHz);
  Matrix drive(1, (first + samples) * ratio);
  double state = 0;
  for (Index k = 0; k < drive.cols(); ++k) {
    state = 0.999 * state + 0.05 * random.normal(1, 1)(0);
    drive(0, k) = 0.004 * state;
  }
  const GeneratedRecord generated = generate_record(truth, drive, kSamplingHz);
  REQUIRE(generated.status == Status::ok);
  FitRecord record;
  record.drive = drive.rightCols(samples * ratio);
  const Matrix clean = generated.signal.y.rightCols(samples);
  record.ratio = ratio;
  record.weight_std = kNoise * (clean.rowwise().norm() / std::sqrt(static_cast<double>(samples)));
  record.y = clean + record.weight_std.asDiagonal() * random.normal(clean.rows(), samples);
  return record;
}

}  // namespace

TEST_CASE("the corner of AC coupling is found, with nothing left, in records that begin in motion and at rest") {
  for (std::uint64_t cell = 0; cell < 6; ++cell) {
    Random random = numbers(7100 + cell);
    const double corner = std::pow(10.0, -1.7 + 1.4 * random.uniform()), from_s = cell % 3 == 0 ? 0 : 40;
    const Plant truth = coupled_car(corner);
    const FitRecord record = cut_record(truth, from_s, 20, random);
    const std::string name = "sensor:" + truth.sensors[0].name + ".high_pass_hz";
    const PlantFit fit =
        fit_plant(coupled_car(1.5 * corner), {{name, 0.05, 0, 1e-6}}, {record}, *make_levenberg_marquardt({}), {40});
    CAPTURE(cell, corner, from_s, fit.solution.message);
    REQUIRE(fit.error.size() == 1);
    CHECK(fit.misfit == Approx(1).epsilon(0.06));
    const double std = 0.05 * std::sqrt(fit.covariance(0, 0));
    CHECK(std::abs(get_parameter(fit.plant, name) - corner) < 4 * std);
    CHECK(std < 0.5 * corner);
  }
}

TEST_CASE("a record that is cut from a run reads as the run, once it is told what the coupling had stored") {
  Random random = numbers(7110);
  for (const double corner : {0.02, 0.3, 3.0}) {
    const Plant plant = coupled_car(corner);
    const Index N = 4000, cut = 1500;
    Matrix ideal = random.normal(plant.sensor_count(), N);  // a random walk: what lies between samples is small
    for (Index k = 1; k < N; ++k) ideal.col(k) = ideal.col(k - 1) + 0.01 * ideal.col(k);
    const Matrix whole = apply_sensor_paths(plant, ideal, kSamplingHz);
    Vector stored = Vector::Constant(plant.sensor_count(), std::numeric_limits<double>::quiet_NaN());
    stored(0) = ideal(0, cut) - whole(0, cut);
    const Matrix part = apply_sensor_paths(plant, ideal.rightCols(N - cut), kSamplingHz, stored);
    CAPTURE(corner);
    CHECK((part - whole.rightCols(N - cut)).cwiseAbs().maxCoeff() < 1e-3 * whole.cwiseAbs().maxCoeff());
    CHECK(part.bottomRows(part.rows() - 1) == whole.rightCols(N - cut).bottomRows(part.rows() - 1));
    CHECK((apply_sensor_paths(plant, ideal.rightCols(N - cut), kSamplingHz) - part).row(0).norm() >
          0.01 * part.row(0).norm());
  }
}

TEST_CASE("a coupling of the slowest corner explains no bias") {
  Random random = numbers(7120);
  const Plant plant = coupled_car(slowest_coupling_hz);
  FitRecord record = cut_record(plant, 0, 10, random);
  record.y.row(0).array() += 5 * record.weight_std(0);
  const PlantFit fit = fit_plant(plant, {}, {record}, *make_levenberg_marquardt({}), {20});
  REQUIRE(fit.error.size() == 1);
  CHECK(fit.error[0].row(0).mean() == Approx(-5 * record.weight_std(0)).epsilon(0.05));
}

TEST_CASE("what each of several couplings has stored has a derivative of its own") {
  Random random = numbers(7130);
  Plant plant = coupled_car(0.1);
  plant.sensors[2].path.high_pass_hz = 0.4;
  const FitRecord record = cut_record(plant, 20, 5, random);
  const std::vector<FitParameter> parameters = {{"sensor:travel.high_pass_hz", 0.05, 0}};
  const Vector scale = Vector::Constant(4, 1e-3), memory_scale = (Vector(2) << 1e-3, 0.5).finished();
  const auto problem = plant_problem(plant, parameters, {record}, scale, memory_scale);
  REQUIRE(problem->parameters() == 7);
  const Vector theta = random.normal(7, 1);
  Vector r(problem->residuals()), ahead = r, behind = r;
  Matrix J(problem->residuals(), 7);
  REQUIRE(problem->jacobian(theta, r, J));
  for (Index j = 0; j < 7; ++j) {
    const double step = 1e-4;
    REQUIRE(problem->residual(theta + step * Vector::Unit(7, j), ahead));
    REQUIRE(problem->residual(theta - step * Vector::Unit(7, j), behind));
    const Vector difference = (ahead - behind) / (2 * step);
    CAPTURE(j);
    REQUIRE(difference.norm() > 0);
    CHECK((J.col(j) - difference).norm() < 1e-2 * difference.norm());
  }
}

TEST_CASE("a coupling that had settled on a deflection before the release is found in a free decay") {
  Random random = numbers(7140);
  for (const double corner : {0.1, 0.5, 2.0}) {
    const Plant plant = coupled_car(corner);
    FitRecord record;
    record.ratio = hold_samples_per_record_sample(plant, kSamplingHz);
    const Index samples = 800;
    record.drive = Matrix::Zero(1, samples * record.ratio);
    InitialState start(Vector(Vector::Zero(4)));
    start.motion(0) = 0.02;
    start.memories = {{"sensor:travel.stored", 0.02}};
    record.y = Matrix::Zero(3, samples);
    record.weight_std = Vector::Ones(3);
    const Simulation run = simulate_measured(plant, record.drive, run_options(plant, record, start));
    REQUIRE(run.status == Status::ok);
    record.weight_std = kNoise * rms(run.outputs);
    record.y = run.outputs + record.weight_std.asDiagonal() * random.normal(3, samples);
    const PlantFit fit = fit_plant(plant, {}, {record}, *make_levenberg_marquardt({}), {30});
    CAPTURE(corner);
    REQUIRE(fit.error.size() == 1);
    CHECK(fit.misfit == Approx(1).epsilon(0.06));
    CHECK(memories_of(plant, fit.initial_states[0])(0) == Approx(0.02).epsilon(0.1));
  }
}

TEST_CASE("a corner that nothing holds ends above zero, where the coupling is still a part of the plant") {
  Random random = numbers(7150);
  const Plant truth = plant_from(quarter_car_text);
  const FitRecord record = cut_record(truth, 0, 10, random);
  const PlantFit fit = fit_plant(coupled_car(0.15), {{"sensor:travel.high_pass_hz", 0.05, 0}}, {record},
                                 *make_levenberg_marquardt({}), {60});
  REQUIRE(fit.error.size() == 1);
  CHECK(fit.misfit == Approx(1).epsilon(0.06));
  CHECK(fit.plant.sensors[0].path.high_pass_hz >= slowest_coupling_hz);
  CHECK(inner_state_names(fit.plant).size() == static_cast<std::size_t>(fit.memory_scale.size()));
  CHECK(fit.jacobian.cols() == 6);
  CHECK(fit.covariance.allFinite());
  Json text = Json::parse(quarter_car_text);
  text["sensors"][0]["high_pass_hz"] = 0;
  CHECK(parse_plant(JsonCursor::from(text, "plant.json")).sensors[0].path.high_pass_hz == 0);
}

TEST_CASE("a coupling is an inner state even where the plant cannot rest under the first sample") {
  Plant plant = plant_from(one_mass_text);
  plant.elements[0].laws[0] = {find_law("hardening_spring"), {18000, 1500, 0.02, 0.09}};
  plant.sensors[0].path.high_pass_hz = 0.2;
  FitRecord record;
  record.drive = Matrix::Constant(1, 100, 1e9);
  record.y = Matrix::Ones(3, 100);
  record.weight_std = Vector::Ones(3);
  REQUIRE(static_equilibrium(plant, record.drive.col(0)).status != Status::ok);
  const InitialState state = with_stored(plant, record, Vector(Vector::Zero(2)));
  CHECK(state.memories == std::vector<std::pair<std::string, double>>{{"sensor:x.stored", 0}});
  const Vector scale = typical_inner_states(plant, {record}, {state});
  REQUIRE(scale.size() == 1);
  CHECK(scale(0) > 0);
}
