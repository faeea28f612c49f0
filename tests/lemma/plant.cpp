// Laws of mechanics that every plant obeys, whatever its graph: action and reaction, energy, exactness on linear
// plants.
#include "core/plant/plant.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <set>

#include "core/base/random.hpp"
#include "core/plant/dataset.hpp"
#include "core/plant/linearise.hpp"
#include "core/plant/road.hpp"
#include "core/plant/rotary.hpp"
#include "core/plant/simulate.hpp"
#include "tests/support/places.hpp"
#include "tests/support/plants.hpp"

using namespace wheelhop;
using namespace wheelhop::test;
using Catch::Contains;

namespace {

Matrix noise_drive(const Plant& plant, Index samples, double rms, double cutoff_hz = 10, std::uint64_t cell = 0) {
  Matrix drive(plant.input_count(), samples);
  Random random(7, Stream::road, cell);
  for (Index i = 0; i < drive.rows(); ++i)
    drive.row(i) =
        make_drive(BandLimitedNoise{.rms = rms, .cutoff_hz = cutoff_hz}, plant.hold_hz(), 0, samples, random).values;
  return drive;
}

double relative_error(ConstMatrixRef value, ConstMatrixRef reference) {
  return (value - reference).norm() / reference.norm();
}

std::vector<Plant> all_plants() {
  return {plant_from(quarter_car_text), plant_from(one_mass_text), plant_from(chain_text), plant_from(shaken_text),
          full_car()};
}

}  // namespace

TEST_CASE("a spring pulls node b toward a, and pushes a as hard the other way") {
  const Plant plant = plant_from(quarter_car_text);
  Motion motion(plant);
  const double u = 0, u_rate = 0;
  motion.set_inputs(&u, &u_rate);
  const Vector v = Vector::Zero(2);
  Vector a(2);
  const Vector lifted = (Vector(2) << 0.03, 0.0).finished();  // the body up, the wheel still: travel +0.03
  REQUIRE(motion.accelerations(lifted.data(), v.data(), a.data()) == Motion::all_defined);
  const double expected = 18000 * (0.03 + 1500 * std::pow(0.03, 3) + 0.02 * std::tan(0.5 * M_PI * 0.03 / 0.09));
  CHECK(a(0) * 300 == Approx(-expected).epsilon(1e-14));
  CHECK(a(1) * 40 == Approx(expected).epsilon(1e-14));

  const Vector rising = (Vector(2) << 1.0, 0.0).finished();
  const Vector q = Vector::Zero(2);
  REQUIRE(motion.accelerations(q.data(), rising.data(), a.data()) == Motion::all_defined);
  CHECK(a(0) * 300 == Approx(-850));
  CHECK(a(1) * 40 == Approx(850));

  const double road_up = 0.01;
  motion.set_inputs(&road_up, &u_rate);
  REQUIRE(motion.accelerations(q.data(), v.data(), a.data()) == Motion::all_defined);
  CHECK(a(0) == 0);
  CHECK(a(1) * 40 == Approx(2000));
}

TEST_CASE("without ground and road no force inside a plant moves its centre of mass") {
  Plant plant = plant_from(chain_text);
  plant.elements.erase(plant.elements.begin());  // the foot
  const Matrix drive = noise_drive(plant, 2000, 3.0);
  Vector start(6);
  start << 0.01, -0.02, 0.03, 0.1, 0.2, -0.5;
  const Simulation run = simulate(plant, drive, {.initial_state = start});
  REQUIRE(run.status == Status::ok);
  const Eigen::RowVectorXd momentum = 3 * run.states.row(3) + 2 * run.states.row(4) + run.states.row(5);
  CHECK((momentum.array() - (3 * 0.1 + 2 * 0.2 - 0.5)).abs().maxCoeff() < 1e-11);
  CHECK(run.states.row(5).cwiseAbs().maxCoeff() > 0.3);  // while the parts do move
}

TEST_CASE("at any state, stored energy grows by the power of the inputs less the heat") {
  for (Plant plant : all_plants()) {
    // A damper at every drive node, so that moving drives do work through it.
    for (Element& element : plant.elements)
      element.laws.push_back({.kind = find_law("viscous_damper"), .values = {130}});
    INFO(plant.name);
    Motion motion(plant);
    Random random(3, Stream::parameters);
    const Index n = plant.mass_count(), m = plant.input_count();
    for (int trial = 0; trial < 20; ++trial) {
      const Vector q = 0.02 * random.normal(n, 1), v = random.normal(n, 1);
      const Vector u = 0.01 * random.normal(m, 1), u_rate = random.normal(m, 1);
      motion.set_inputs(u.data(), u_rate.data());
      Vector a(n);
      REQUIRE(motion.accelerations(q.data(), v.data(), a.data()) == Motion::all_defined);
      const Motion::Energy now = motion.energy(q.data(), v.data());
      const double step_s = 1e-6;
      const Vector before = q - step_s * v, after = q + step_s * v;
      const double stored_w =
          (motion.energy(after.data(), v.data()).potential_j - motion.energy(before.data(), v.data()).potential_j) /
          (2 * step_s);
      double kinetic_w = 0;
      for (Index i = 0; i < n; ++i) kinetic_w += plant.masses[static_cast<std::size_t>(i)].mass_kg * v(i) * a(i);
      const double scale = std::abs(stored_w) + std::abs(now.input_w) + now.dissipated_w;
      CHECK(std::abs(kinetic_w + stored_w - (now.input_w - now.dissipated_w)) < 1e-7 * scale);
      CHECK(now.dissipated_w > 0);
    }
  }
}

TEST_CASE("over a nonlinear run the change of stored energy is the work of the inputs less the heat") {
  Plant plant = plant_from(quarter_car_text);
  plant.inputs[0].hold_hz = 4000;
  plant.inputs.push_back(
      {.name = "push", .kind = InputKind::force, .unit = "N", .hold_hz = 4000, .from = "ground", .to = "body"});
  // Every drive value stands for two samples, so that Simpson's rule integrates each piece between two drive steps.
  const Index pieces = 8000;
  Plant slow = plant;
  for (PlantInput& input : slow.inputs) input.hold_hz = 2000;
  const Matrix held = noise_drive(slow, pieces, 0.0155);
  Matrix drive(2, 2 * pieces + 1);
  for (Index k = 0; k < 2 * pieces; ++k) drive.col(k) << held(0, k / 2), 4e4 * held(1, k / 2);
  drive.col(2 * pieces) = drive.col(2 * pieces - 1);
  const Simulation run = simulate(plant, drive);
  REQUIRE(run.status == Status::ok);
  REQUIRE(run.outputs.row(0).cwiseAbs().maxCoeff() > 0.05);  // deep in the nonlinear range

  Motion motion(plant);
  const Vector u_rate = Vector::Zero(2);
  const auto energy = [&](Index input_sample, Index state_sample) {
    const Vector u = drive.col(input_sample), x = run.states.col(state_sample);
    motion.set_inputs(u.data(), u_rate.data());
    return motion.energy(x.data(), x.data() + 2);
  };
  const auto stored = [](const Motion::Energy& e) { return e.kinetic_j + e.potential_j; };
  double work_j = 0, heat_j = 0;
  for (Index k = 0; k < 2 * pieces; k += 2) {
    const Motion::Energy start = energy(k, k), middle = energy(k, k + 1), end = energy(k, k + 2);
    if (k > 0) work_j += start.potential_j - energy(k - 1, k).potential_j;  // the road's step works on the tyre
    const Vector moved = run.states.col(k + 2) - run.states.col(k);
    work_j += drive(1, k) * moved(0);
    heat_j += (start.dissipated_w + 4 * middle.dissipated_w + end.dissipated_w) / 6 * (2 / 4000.0);
  }
  const double change_j = stored(energy(2 * pieces - 1, 2 * pieces)) - stored(energy(0, 0));
  REQUIRE(heat_j > 100);
  CHECK(std::abs(change_j - (work_j - heat_j)) < 1e-7 * heat_j);
}

TEST_CASE("halving the step divides the integration error by sixteen") {
  Plant plant = plant_from(quarter_car_text);
  plant.inputs[0].hold_hz = 250;
  Matrix drive = Matrix::Constant(1, 126, 0.02);
  const auto end_state = [&](Index substeps) {
    const Simulation run = simulate(plant, drive, {.substeps = substeps});
    REQUIRE(run.status == Status::ok);
    return Vector(run.states.col(125));
  };
  const Vector exact = end_state(128);
  const double coarse = (end_state(2) - exact).norm(), fine = (end_state(4) - exact).norm(),
               finer = (end_state(8) - exact).norm();
  CHECK(coarse / fine == Approx(16).epsilon(0.2));
  CHECK(fine / finer == Approx(16).epsilon(0.1));
}

TEST_CASE("a linear plant simulates to its exact discretisation, dampers at the drive included") {
  for (const Plant& plant : {plant_from(chain_text), full_car()}) {
    INFO(plant.name);
    const Matrix drive = noise_drive(plant, 3000, 0.01, 40);
    const LinearPlant model = linearise(plant);
    REQUIRE(model.status == Status::ok);
    const Index m = plant.input_count();
    Matrix B(model.B.rows(), 2 * m), D(model.D.rows(), 2 * m);
    B << model.B, model.B_rate;
    D << model.D, model.D_rate;
    const DiscreteInput step = discretise_zoh(model.A, B, 1 / plant.hold_hz());
    Matrix expected(plant.sensor_count(), drive.cols());
    Vector x = Vector::Zero(model.A.rows()), input(2 * m);
    for (Index k = 0; k < drive.cols(); ++k) {
      input.head(m) = drive.col(k);
      input.tail(m) = k > 0 ? Vector((drive.col(k) - drive.col(k - 1)) * plant.hold_hz()) : Vector::Zero(m);
      expected.col(k) = model.C * x + D * input;
      x = step.A * x + step.B * input;
    }
    const Simulation once = simulate(plant, drive), often = simulate(plant, drive, {.substeps = 16});
    REQUIRE(once.status == Status::ok);
    for (Index i = 0; i < expected.rows(); ++i) {
      CHECK(relative_error(once.outputs.row(i), expected.row(i)) < 2e-5);
      CHECK(relative_error(often.outputs.row(i), expected.row(i)) < 1e-9);
    }
  }
}

TEST_CASE("the linearisation is the derivative of accelerations and sensors") {
  for (Plant plant : all_plants()) {
    for (Element& element : plant.elements)
      element.laws.push_back({.kind = find_law("viscous_damper"), .values = {130}});
    INFO(plant.name);
    const Index n = plant.mass_count(), m = plant.input_count(), p = plant.sensor_count();
    Random random(5, Stream::parameters);
    const Vector x = 0.02 * random.normal(2 * n, 1), u = 0.01 * random.normal(m, 1);
    const LinearPlant model = linearise(plant, x, u);
    REQUIRE(model.status == Status::ok);
    Motion motion(plant);
    const auto evaluate = [&](const Vector& state, const Vector& input, const Vector& rate) {
      Vector result(2 * n + p);
      result.head(n) = state.tail(n);
      motion.set_inputs(input.data(), rate.data());
      REQUIRE(motion.accelerations(state.data(), state.data() + n, result.data() + n) == Motion::all_defined);
      motion.outputs(state.data(), state.data() + n, result.data() + n, result.data() + 2 * n);
      return result;
    };
    const double h = 1e-5;
    Matrix numerical(2 * n + p, 2 * n + 2 * m), analytic(2 * n + p, 2 * n + 2 * m);
    analytic << model.A, model.B, model.B_rate, model.C, model.D, model.D_rate;
    for (Index j = 0; j < 2 * n + 2 * m; ++j) {
      Vector point(2 * n + 2 * m);
      point << x, u, Vector::Zero(m);
      const auto at = [&](double shift) {
        Vector moved = point;
        moved(j) += shift;
        return evaluate(moved.head(2 * n), moved.segment(2 * n, m), moved.tail(m));
      };
      numerical.col(j) = (at(h) - at(-h)) / (2 * h);
      const double scale = std::max(1.0, numerical.col(j).cwiseAbs().maxCoeff());
      CHECK((numerical.col(j) - analytic.col(j)).cwiseAbs().maxCoeff() < 1e-6 * scale);
    }
  }
}

TEST_CASE("along a motion the linear plant has the mean of the slopes: k + 3 k_3 s^2 of a cubic spring") {
  const Plant plant = plant_from(one_mass_text);  // 2 kg, 800 N/m and 50000 N/m^3
  Random random(6, Stream::parameters);
  Matrix states = 0.1 * random.normal(2, 400);
  const double variance = states.row(0).squaredNorm() / 400;
  const LinearPlant moving = linearise_along(plant, states, Matrix::Zero(1, 400));
  REQUIRE(moving.status == Status::ok);
  CHECK(moving.A(1, 0) == Approx(-(800 + 3 * 50000 * variance) / 2).epsilon(1e-12));
  CHECK(moving.A(1, 1) == Approx(linearise(plant).A(1, 1)));
  const Vector point = states.col(0), load = Vector::Constant(1, 3);
  CHECK(linearise_along(plant, point, load).A == linearise(plant, point, load).A);
  CHECK_THROWS_AS(linearise_along(plant, states, Matrix::Zero(1, 3)), UserError);
}

TEST_CASE("small motion about a loaded equilibrium follows the linearisation there") {
  const Plant plant = plant_from(one_mass_text);
  const Vector load = Vector::Constant(1, 60);
  const Equilibrium rest = static_equilibrium(plant, load);
  REQUIRE(rest.status == Status::ok);
  const double x0 = rest.positions(0);
  CHECK(800 * x0 + 50000 * x0 * x0 * x0 == Approx(60).epsilon(1e-12));
  CHECK(x0 < 60.0 / 800);  // the spring hardens

  const Vector state = (Vector(2) << x0, 0).finished();
  const LinearPlant model = linearise(plant, state, load);
  const DiscreteInput step = discretise_zoh(model.A, model.B, 1 / plant.hold_hz());
  const Matrix small = noise_drive(plant, 2000, 1e-4);
  const Simulation run = simulate(plant, small.array() + 60, {.from_equilibrium = true});
  REQUIRE(run.status == Status::ok);
  // From rest in the equilibrium of the first sample, as the simulation starts.
  Vector x = Vector::Zero(2);
  x(0) = small(0, 0) / (800 + 3 * 50000 * x0 * x0);
  Matrix expected(3, small.cols());
  for (Index k = 0; k < small.cols(); ++k) {
    expected.col(k) = model.C * x + model.D * small.col(k);
    x = step.A * x + step.B * small.col(k);
  }
  expected.row(0).array() += x0;
  CHECK((run.outputs.row(0) - expected.row(0)).norm() < 1e-5 * (expected.row(0).array() - x0).matrix().norm());
  CHECK(relative_error(run.outputs.row(1), expected.row(1)) < 1e-5);
  CHECK(relative_error(run.outputs.row(2), expected.row(2)) < 1e-5);
}

TEST_CASE("the modes of a one-mass plant are those of the textbook") {
  const Plant plant = plant_from(one_mass_text);
  const std::vector<Mode> list = modes(linearise(plant).A);
  REQUIRE(list.size() == 1);
  CHECK(list[0].frequency_hz == Approx(std::sqrt(800.0 / 2) / (2 * M_PI)));
  CHECK(list[0].damping_ratio == Approx(4 / (2 * std::sqrt(800.0 * 2))));
}

TEST_CASE("a full car in points and masses has the matrices of the textbook's seven degrees of freedom") {
  const Plant plant = full_car();
  REQUIRE(plant.mass_count() == 7);
  REQUIRE(plant.input_count() == 4);
  REQUIRE(plant.sensor_count() == 12);
  // z_corner = G (heave, pitch, roll); K = [G'kG, -G'k; -kG, k + kt]
  Matrix G(4, 3);
  G << 1, -1.2, 0.7, 1, -1.2, -0.7, 1, 1.5, 0.7, 1, 1.5, -0.7;
  const Vector k = (Vector(4) << 22000, 22000, 25000, 25000).finished();
  Matrix K(7, 7);
  K << G.transpose() * k.asDiagonal() * G, -(G.transpose() * k.asDiagonal()), -(k.asDiagonal() * G),
      Matrix(k.asDiagonal()) + 190000 * Matrix::Identity(4, 4);
  const Vector mass = (Vector(7) << 1300, 1900, 480, 40, 40, 45, 45).finished();
  const LinearPlant model = linearise(plant);
  CHECK(relative_error(model.A.bottomLeftCorner(7, 7), -(mass.cwiseInverse().asDiagonal() * K)) < 1e-14);
  Matrix B = Matrix::Zero(7, 4);
  B.bottomRows(4) = 190000 * Matrix(mass.tail(4).cwiseInverse().asDiagonal());
  CHECK(relative_error(model.B.bottomRows(7), B) < 1e-14);
  CHECK(modes(model.A).size() == 7);

  // All four roads alike and one metre up: the whole car, corners too, ends one metre up.
  const Equilibrium rest = static_equilibrium(plant, Vector::Ones(4));
  REQUIRE(rest.status == Status::ok);
  CHECK(rest.positions(0) == Approx(1));
  CHECK(std::abs(rest.positions(1)) < 1e-12);
  CHECK(rest.positions.tail(4).isApproxToConstant(1, 1e-12));
}

TEST_CASE("a stage at the pole of the end stop ends the simulation with time and element") {
  const Plant plant = plant_from(quarter_car_text);
  const auto start_at = [&](double travel) {
    const Vector start = (Vector(4) << travel, 0, 0, 0).finished();
    return simulate(plant, Matrix::Zero(1, 3), {.substeps = 1000, .initial_state = start});
  };
  CHECK(start_at(0.0899).status == Status::ok);
  CHECK(start_at(-0.0899).status == Status::ok);
  for (const double beyond : {0.09, 0.0901, -0.09, 0.5}) {
    const Simulation run = start_at(beyond);
    CHECK(run.status == Status::outside_domain);
    CHECK(run.failure_time_s == 0);
    CHECK_THAT(run.message, Contains("\"suspension\""));
    CHECK(run.outputs.cols() == 0);
  }
  // Driven: fine at the level of the preset; at twice that the travel ends at the pole, in the very interval.
  const Matrix drive = noise_drive(plant, 20000, 0.0155);
  const Simulation mild = simulate(plant, drive);
  REQUIRE(mild.status == Status::ok);
  const Simulation rough = simulate(plant, 2 * drive);
  REQUIRE(rough.status == Status::outside_domain);
  REQUIRE(rough.outputs.cols() > 0);
  CHECK(rough.outputs.row(0).cwiseAbs().maxCoeff() < 0.09);
  CHECK(std::abs(rough.outputs(0, rough.outputs.cols() - 1)) > 0.08);
  const double last_s = static_cast<double>(rough.outputs.cols() - 1) / 1000;
  CHECK(rough.failure_time_s == Approx(last_s).margin(1e-9));
  CHECK_THAT(rough.message, Contains("\"suspension\"") && Contains("t = ") && Contains("travel"));
  // The same drive after a lead: the clock starts at the first kept sample.
  const Simulation later = simulate(plant, 2 * drive, {.lead_samples = 100});
  CHECK(later.failure_time_s == Approx(rough.failure_time_s - 0.1).margin(1e-9));
}

TEST_CASE("a force that overflows counts as outside the domain, a drive with NaN as not finite") {
  Plant plant = plant_from(one_mass_text);
  set_parameter(plant, "spring.polynomial_spring.coefficients_3", -1e9);
  const Simulation run = simulate(plant, Matrix::Constant(1, 5000, 500.0));
  CHECK(run.status == Status::outside_domain);
  CHECK_THAT(run.message, Contains("\"spring\""));
  Matrix drive = Matrix::Zero(1, 10);
  drive(0, 4) = std::nan("");
  CHECK(simulate(plant, drive).status == Status::not_finite);
}

TEST_CASE("a start from equilibrium stays at rest, whatever the offset of the drive") {
  for (const Plant& plant : all_plants()) {
    INFO(plant.name);
    const Matrix drive = Matrix::Constant(plant.input_count(), 500, 0.4);
    const Simulation run = simulate(plant, drive, {.from_equilibrium = true});
    REQUIRE(run.status == Status::ok);
    CHECK(run.states.bottomRows(plant.mass_count()).cwiseAbs().maxCoeff() < 1e-9);
  }
  Plant loose = plant_from(one_mass_text);
  loose.elements[0].laws.erase(loose.elements[0].laws.begin());  // no spring: nothing balances a constant force
  CHECK(static_equilibrium(loose, Vector::Ones(1)).status == Status::rank_deficient);
  CHECK(static_equilibrium(loose, Vector::Zero(1)).status == Status::ok);
}

TEST_CASE("an unstable plant is reported with the rate of its growth") {
  Plant plant = plant_from(one_mass_text);
  set_parameter(plant, "spring.polynomial_spring.coefficients_1", -800);
  set_parameter(plant, "spring.viscous_damper.damping_ns_per_m", 0);
  const LinearPlant model = linearise(plant);
  CHECK(model.status == Status::unstable);
  CHECK_THAT(model.message, Contains("+20"));
  CHECK(model.A(1, 0) == Approx(400));
}

TEST_CASE("kept samples are those of the full simulation, and speeds are the slopes of positions") {
  const Plant plant = plant_from(chain_text);
  const Matrix drive = noise_drive(plant, 2003, 0.01);
  const Simulation full = simulate(plant, drive);
  const Simulation kept = simulate(plant, drive, {.decimation = 5, .lead_samples = 100});
  REQUIRE(kept.outputs.cols() == 381);
  for (Index k = 0; k < kept.outputs.cols(); ++k) REQUIRE(kept.outputs.col(k) == full.outputs.col(100 + 5 * k));
  CHECK(kept.states.col(380) == full.states.col(2000));
  const Eigen::RowVectorXd slope = (full.states.row(2).tail(2001) - full.states.row(2).head(2001)) * 500.0;
  const Eigen::RowVectorXd stroke = full.outputs.row(0), foot = full.outputs.row(1);
  CHECK(relative_error(slope, full.states.row(5).segment(1, 2001)) < 1e-3);
  CHECK(relative_error(stroke, full.states.row(2) - full.states.row(1)) == 0);
  CHECK(relative_error(foot, full.states.row(0) - drive.row(0)) == 0);
}

TEST_CASE("a record drives the plant as the drive it was picked from, if interpolated in its band") {
  Plant plant = plant_from(quarter_car_text);
  const Matrix drive = noise_drive(plant, 20000, 0.0155);
  const GeneratedRecord made = generate_record(plant, drive, 200, {.lead_samples = 2000});
  REQUIRE(made.status == Status::ok);
  REQUIRE(made.signal.samples() == 3600);
  CHECK(made.signal.sample_time_s == 0.005);
  CHECK(made.signal.u(0, 10) == drive(0, 2050));
  CHECK(made.signal.outputs[1].name == "body_acc");
  CHECK(made.signal.outputs[1].unit == "m/s^2");
  const auto error = [&](const char* interpolation) {
    plant.inputs[0].interpolation = interpolation;
    const GeneratedRecord again = simulate_record(plant, made.signal, {.initial_state = made.states.col(0)});
    REQUIRE(again.status == Status::ok);
    REQUIRE(again.signal.samples() == 3600);
    return relative_error(again.signal.y.row(2).segment(800, 2700), made.signal.y.row(2).segment(800, 2700));
  };
  const double in_band = error("band_limited"), line = error("linear"), hold = error("zoh");
  CHECK(in_band < 2e-3);
  CHECK(line > 3 * in_band);
  CHECK(hold > 3 * line);
}

TEST_CASE("rates that do not divide, wrong shapes and missing channels are refused by name") {
  const Plant plant = plant_from(quarter_car_text);
  CHECK_THROWS_WITH(hold_samples_per_record_sample(plant, 300), Contains("300") && Contains("1000"));
  CHECK_THROWS_WITH(hold_samples_per_record_sample(plant, 2000), Contains("2000"));
  CHECK(hold_samples_per_record_sample(plant, 1 / (1 / 200.0)) == 5);
  CHECK_THROWS_WITH(simulate(plant, Matrix::Zero(2, 10)), Contains("1 rows") && Contains("found 2"));
  CHECK_THROWS_AS(simulate(plant, Matrix::Zero(1, 10), {.initial_state = Vector::Zero(3)}), UserError);
  CHECK_THROWS_AS(simulate(plant, Matrix::Zero(1, 10), {.lead_samples = 10}), UserError);
  Signal record;
  record.u = Matrix::Zero(1, 100);
  record.sample_time_s = 0.005;
  record.inputs = {{"pan", "m"}};
  CHECK_THROWS_WITH(simulate_record(plant, record), Contains("\"road\"") && Contains("pan"));
  record.inputs = {{"road", "mm"}};
  CHECK_THROWS_WITH(simulate_record(plant, record), Contains("in m") && Contains("mm"));
}

namespace {

/// A motor and a load on a shaft, and a rack that the load moves.
const char* const kTwoInertias = R"({
  "name": "axis",
  "masses": [{"name": "motor", "inertia_kg_m2": 0.02}, {"name": "load", "inertia_kg_m2": 0.05, "tolerance": 0.1}],
  "points": [{"name": "rack", "weights": {"load": 0.03}, "unit": "m"}],
  "inputs": [{"name": "drive", "kind": "torque", "on": "motor", "unit": "N m", "hold_hz": 1000}],
  "elements": [
    {"name": "shaft", "between": ["motor", "load"], "laws": [
      {"law": "linear_spring", "stiffness_nm_per_rad": 40},
      {"law": "viscous_damper", "damping_nms_per_rad": 0.02},
      {"law": "bouc_wen", "torque_nm": 0.1, "yield_travel_rad": 0.002}]},
    {"name": "bearing", "between": ["ground", "load"], "laws": [
      {"law": "coulomb_friction", "torque_nm": 0.05, "velocity_rad_per_s": 0.1},
      {"law": "linear_spring", "stiffness_nm_per_rad": 5}]},
    {"name": "guide", "between": ["ground", "rack"], "laws": [{"law": "viscous_damper", "damping_ns_per_m": 3}]}],
  "loads": [{"name": "weight", "on": "load", "torque_nm": 0.2}],
  "sensors": [
    {"name": "phi", "kind": "angle", "of": "motor", "unit": "rad"},
    {"name": "twist", "kind": "angle", "between": ["motor", "load"], "unit": "rad"},
    {"name": "speed", "kind": "angular_velocity", "of": "load", "unit": "rad/s"},
    {"name": "jerk", "kind": "angular_acceleration", "of": "load", "unit": "rad/s^2"},
    {"name": "cell", "kind": "torque", "element": "shaft", "unit": "N m"},
    {"name": "x", "kind": "displacement", "of": "rack", "unit": "m"}]})";

/// The same numbers under the names of what slides.
std::string sliding(std::string text) {
  for (const auto& [turns, slides] :
       std::vector<std::pair<std::string, std::string>>{{"inertia_kg_m2", "mass_kg"},
                                                        {"nms_per_rad", "ns_per_m"},
                                                        {"nm_per_rad", "n_per_m"},
                                                        {"rad_per_s", "m_per_s"},
                                                        {"travel_rad", "travel_m"},
                                                        {"torque_nm", "force_n"},
                                                        {"angular_velocity", "velocity"},
                                                        {"angular_acceleration", "acceleration"},
                                                        {"\"angle\"", "\"displacement\""},
                                                        {"\"torque\"", "\"force\""},
                                                        {"N m", "N"},
                                                        {"\"rad", "\"m"},
                                                        {", \"unit\": \"m\"}],\n  \"inputs\"", "}],\n  \"inputs\""}})
    for (std::size_t at = text.find(turns); at != std::string::npos; at = text.find(turns, at + slides.size()))
      text.replace(at, turns.size(), slides);
  return text;
}

}  // namespace

TEST_CASE("what turns moves as what slides with the same numbers, and is written and read in its own names") {
  const Plant turning = plant_from(kTwoInertias), slides = plant_from(sliding(kTwoInertias));
  const Matrix drive = Matrix::Random(1, 2000);
  const Simulation one = simulate(turning, drive), other = simulate(slides, drive);
  REQUIRE(one.status == Status::ok);
  CHECK(one.outputs == other.outputs);
  const Json written = to_json(turning);
  CHECK(to_json(parse_plant(JsonCursor::from(written, "plant.json"))) == written);
  CHECK(written.dump().find("_n_per_m\"") == std::string::npos);
  CHECK(written["elements"][0]["laws"][2].contains("yield_travel_rad"));
  CHECK(written["elements"][2]["laws"][0].contains("damping_ns_per_m"));  // the rack slides
  CHECK(written["sensors"][4]["kind"] == "torque");
  // A name is shown as its file has it, and parameters are the same numbers in the same order.
  const std::vector<PlantParameter> own = plant_parameters(turning), same = plant_parameters(slides);
  REQUIRE(own.size() == same.size());
  for (std::size_t i = 0; i < own.size(); ++i) {
    CHECK(own[i].value == same[i].value);
    CHECK(shown_name(slides, same[i].name) == same[i].name);
  }
  CHECK(shown_name(turning, "motor.mass_kg") == "motor.inertia_kg_m2");
  CHECK(shown_name(turning, "shaft.bouc_wen.yield_travel_m") == "shaft.bouc_wen.yield_travel_rad");
  CHECK(shown_name(turning, "guide.viscous_damper.damping_ns_per_m") == "guide.viscous_damper.damping_ns_per_m");
  CHECK(shown_name(turning, "load:weight.force_n") == "load:weight.torque_nm");
  CHECK(shown_name(turning, "sensor:phi.gain") == "sensor:phi.gain");
  CHECK(force_unit(turning, "shaft"_at) == "N m");
  CHECK(force_unit(turning, "guide:motor"_at) == "N m");
  CHECK(force_unit(turning, "guide"_at) == "N");
  CHECK(motion_unit(turning, "shaft.velocity") == "rad/s");
  CHECK(motion_unit(turning, "guide.travel") == "m");
}

TEST_CASE("every key of every law has one name of what turns, which no other key has") {
  for (const LawKind& kind : law_table()) {
    std::set<std::string> turned;
    for (const LawParameter& parameter : kind.parameters) {
      CAPTURE(kind.name, parameter.name);
      const std::string name = rotary_name(parameter.name);
      CHECK(turned.insert(name).second);
      // What has a length, a force or a mass in its unit is called otherwise; what has none keeps its name.
      const bool counts = parameter.unit.find_first_of("mN") != std::string::npos || parameter.unit == "kg";
      CHECK(((name != parameter.name) == (counts && !parameter.is_list) || parameter.name == "coefficients" ||
             parameter.name == "per_m"));
      CHECK(name.find("_n_per_m") == std::string::npos);
    }
  }
  CHECK(rotary_name("per_m_2") == "per_rad_2");
}

TEST_CASE("what turns joined to what slides is refused, and the other name of a key said") {
  const auto refused = [](std::string text, const std::string& what, const std::string& with, const std::string& says) {
    const std::size_t at = text.find(what);
    REQUIRE(at != std::string::npos);
    text.replace(at, what.size(), with);
    CAPTURE(with);
    CHECK_THROWS_WITH(plant_from(text), Contains(says));
  };
  const std::string text = kTwoInertias;
  refused(text, "stiffness_nm_per_rad", "stiffness_n_per_m", "stiffness_nm_per_rad");
  refused(text, "\"inertia_kg_m2\": 0.05", "\"mass_kg\": 0.05", "something that turns");
  refused(text, "\"inertia_kg_m2\": 0.02", "\"inertia_kg_m2\": 0.02, \"mass_kg\": 1", "no mass beside");
  refused(text, "\"kind\": \"torque\", \"on\"", "\"kind\": \"force\", \"on\"", "unit");
  refused(text, "\"kind\": \"angle\", \"of\": \"motor\", \"unit\": \"rad\"",
          "\"kind\": \"displacement\", \"of\": \"motor\", \"unit\": \"m\"", "something that slides");
  refused(text, "\"kind\": \"displacement\", \"of\": \"rack\", \"unit\": \"m\"",
          "\"kind\": \"angle\", \"of\": \"rack\", \"unit\": \"rad\"", "something that turns");
  refused(text, "\"kind\": \"torque\", \"element\": \"shaft\"", "\"kind\": \"torque\", \"element\": \"guide\"",
          "an element that turns");
  refused(text, "torque_nm", "force_n", "torque_nm");
  refused(text, "\"between\": [\"ground\", \"rack\"]", "\"between\": [\"motor\", \"rack\"]", "something that turns");
}
