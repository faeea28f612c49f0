// Inerters: a mass matrix that is not diagonal, in everything that is computed of a plant.
#include <catch2/catch.hpp>
#include <cmath>

#include "core/plant/dataset.hpp"
#include "core/plant/linearise.hpp"
#include "core/plant/simulate.hpp"
#include "tests/support/plants.hpp"

using namespace wheelhop;
using namespace wheelhop::test;
using Catch::Contains;

namespace {

Law inerter_of(double inertance_kg) { return {find_law("inerter"), {inertance_kg}}; }

/// The quarter car with an inerter beside its strut.
Plant with_inerter(double inertance_kg) {
  Plant plant = plant_from(quarter_car_text);
  plant.elements[0].laws.push_back(inerter_of(inertance_kg));
  return plant;
}

Matrix smooth_drive(const Plant& plant, Index samples) {
  Matrix drive(plant.input_count(), samples);
  for (Index i = 0; i < drive.rows(); ++i)
    for (Index k = 0; k < samples; ++k) {
      const double t = static_cast<double>(k) / plant.hold_hz();
      drive(i, k) = 0.004 * (std::sin(9 * t + static_cast<double>(i)) + 0.3 * std::sin(60 * t));
    }
  return drive;
}

}  // namespace

TEST_CASE("with an inerter the masses are accelerated by the solution of M a = f") {
  const double b = 12;
  const Plant plain = plant_from(quarter_car_text);
  Motion with(with_inerter(b)), without(plain);
  CHECK(with.coupled());
  CHECK_FALSE(without.coupled());
  const Matrix M = (Matrix(2, 2) << 300 + b, -b, -b, 40 + b).finished();
  CHECK((with.mass_matrix() - M).norm() < 1e-12);
  CHECK((with.inverse_mass_matrix() * M - Matrix::Identity(2, 2)).norm() < 1e-12);
  CHECK(without.inverse_mass_matrix() == Matrix((Matrix(2, 2) << 1.0 / 300, 0, 0, 1.0 / 40).finished()));
  const Vector q = (Vector(2) << 0.01, -0.004).finished(), v = (Vector(2) << 0.2, -0.3).finished();
  const double u = 0.006, rate = 0.1;
  with.set_inputs(&u, &rate);
  without.set_inputs(&u, &rate);
  Vector a(2), alone(2);
  REQUIRE(with.accelerations(q.data(), v.data(), a.data()) == Motion::all_defined);
  REQUIRE(without.accelerations(q.data(), v.data(), alone.data()) == Motion::all_defined);
  const Vector force = without.mass_matrix() * alone;  // of all other laws
  CHECK((M * a - force).norm() < 1e-10 * force.norm());
  // By the law's own formula: it pulls with b times the acceleration of the travel.
  const double pull = b * (a(0) - a(1));
  CHECK(300 * a(0) == Approx(force(0) - pull));
  CHECK(40 * a(1) == Approx(force(1) + pull));
}

TEST_CASE("an inerter to the ground is a part of its mass, one of no inertance nothing") {
  Plant heavy = plant_from(one_mass_text), held = heavy;
  heavy.masses[0].mass_kg = 3.5;
  held.elements[0].laws.push_back(inerter_of(1.5));
  const Matrix drive = 1000 * smooth_drive(held, 800);
  const Simulation one = simulate(heavy, drive), other = simulate(held, drive);
  REQUIRE(other.status == Status::ok);
  CHECK((one.outputs - other.outputs).norm() < 1e-10 * one.outputs.norm());
  const Plant plain = plant_from(quarter_car_text);
  const Matrix road = smooth_drive(plain, 800);
  const Simulation as_before = simulate(plain, road), idle = simulate(with_inerter(0), road);
  CHECK((as_before.outputs - idle.outputs).norm() < 1e-10 * as_before.outputs.norm());
  CHECK((as_before.outputs - simulate(with_inerter(10), road).outputs).norm() > 0.01 * as_before.outputs.norm());
}

TEST_CASE("an undamped plant with an inerter keeps its energy, that of the inerter included") {
  Plant plant = with_inerter(15);
  plant.elements[0].laws.erase(plant.elements[0].laws.begin() + 1);
  const Vector start = (Vector(4) << 0.02, 0.004, -0.1, 0.3).finished();
  const Matrix still = Matrix::Zero(1, 2000);
  const Simulation run = simulate(plant, still, {.substeps = 4, .initial_state = start});
  REQUIRE(run.status == Status::ok);
  Motion motion(plant);
  const double zero = 0;
  motion.set_inputs(&zero, &zero);
  const auto energy = [&](Index k) {
    const Vector x = run.states.col(k);
    const Motion::Energy own = motion.energy(x.data(), x.data() + 2);
    return own.kinetic_j + own.potential_j;
  };
  CHECK(energy(0) ==
        Approx(0.5 * (300 * 0.01 + 40 * 0.09 + 15 * 0.16) + motion.energy(start.data(), start.data() + 2).potential_j));
  for (const Index k : {300, 900, 1999}) CHECK(energy(k) == Approx(energy(0)).epsilon(1e-6));
}

TEST_CASE("an inerter between rigid points, side by side in lanes, is that of the equations one by one") {
  Plant car = full_car();
  for (Element& element : car.elements)
    if (element.name.starts_with("strut")) element.laws.push_back(inerter_of(8));
  const Motion motion(car);
  const Matrix M = motion.mass_matrix();
  CHECK((M - M.transpose()).norm() == 0);
  // The front left corner moves by heave - 1.2 pitch + 0.7 roll.
  CHECK(M(0, 0) == Approx(1300 + 4 * 8));
  CHECK(M(0, car.node("wheel_fl")) == Approx(-8));
  CHECK(M(1, car.node("wheel_fl")) == Approx(8 * 1.2));
  CHECK(M(2, car.node("wheel_fl")) == Approx(-8 * 0.7));
  std::vector<Plant> cars(4, car);
  for (std::size_t i = 0; i < cars.size(); ++i)
    set_parameter(cars[i], "strut_fl.inerter.inertance_kg", 3 + 4 * static_cast<double>(i));
  const Matrix drive = smooth_drive(car, 300);
  std::vector<SimulationTask> tasks;
  for (const Plant& own : cars) tasks.push_back({&own, &drive});
  const std::vector<Simulation> together = simulate_side_by_side(tasks);
  for (std::size_t i = 0; i < cars.size(); ++i) {
    const Simulation alone = simulate(cars[i], drive);
    REQUIRE(alone.status == Status::ok);
    CHECK((alone.outputs - together[i].outputs).norm() < 1e-10 * alone.outputs.norm());
    // The accelerometers read the equation of motion of `Motion`, at the end of the run.
    Motion equations(cars[i]);
    const Vector x = alone.states.col(299), none = Vector::Zero(car.input_count());
    const Vector u = drive.col(299), u_rate = (drive.col(299) - drive.col(298)) * car.hold_hz();
    equations.set_inputs(u.data(), u_rate.data());
    Vector a(car.mass_count()), y(car.sensor_count());
    REQUIRE(equations.accelerations(x.data(), x.data() + car.mass_count(), a.data()) == Motion::all_defined);
    equations.outputs(x.data(), x.data() + car.mass_count(), a.data(), y.data());
    CHECK((y - alone.outputs.col(299)).norm() < 1e-9 * y.norm());
  }
}

TEST_CASE("linearised, an inerter changes the accelerations and no equilibrium") {
  const double b = 25;
  const Plant plant = with_inerter(b);
  const LinearPlant model = linearise(plant), plain = linearise(plant_from(quarter_car_text));
  const Matrix M = Motion(plant).mass_matrix(), diagonal = Motion(plant_from(quarter_car_text)).mass_matrix();
  CHECK((M * model.A.bottomRows(2) - diagonal * plain.A.bottomRows(2)).norm() < 1e-9 * plain.A.norm());
  CHECK((M * model.B.bottomRows(2) - diagonal * plain.B.bottomRows(2)).norm() < 1e-9 * plain.B.norm());
  // Accelerometers read the rows of the accelerations.
  CHECK((model.C.row(1) - model.A.row(2)).norm() < 1e-9 * model.A.row(2).norm());
  Plant pushed = plant;
  pushed.inputs.push_back({"push", InputKind::force, "N", 1000, "zoh", "wheel", "body"});
  const LinearPlant forced = linearise(pushed);
  CHECK((M * forced.B.col(1).tail(2) - (Vector(2) << 1, -1).finished()).norm() < 1e-12);
  const Vector u = Vector::Constant(1, 0.01);
  const Equilibrium rest = static_equilibrium(plant, u);
  REQUIRE(rest.status == Status::ok);
  CHECK((rest.positions - static_equilibrium(plant_from(quarter_car_text), u).positions).norm() < 1e-9);
}

TEST_CASE("the derivatives of a simulation with an inerter are its differences, in masses, inertance and drive") {
  Plant plant = with_inerter(12);
  plant.inputs.push_back({"push", InputKind::force, "N", 1000, "zoh", "ground", "body"});
  plant.inputs.push_back({"pull", InputKind::force, "N", 1000, "zoh", "wheel", "body"});
  Matrix drive = smooth_drive(plant, 1500);
  drive.bottomRows(2) *= 1e4;
  const SimulateOptions options{.substeps = 2, .decimation = 5};
  for (const std::string name : {"suspension.inerter.inertance_kg", "body.mass_kg", "wheel.mass_kg",
                                 "suspension.viscous_damper.damping_ns_per_m", "tyre.linear_spring.stiffness_n_per_m",
                                 "actuator:road.gain", "actuator:push.gain", "actuator:pull.gain"}) {
    CAPTURE(name);
    const double step = 1e-4 * get_parameter(plant, name);
    const auto at = [&](double steps) {
      Plant there = plant;
      set_parameter(there, name, get_parameter(plant, name) + steps * step);
      return there;
    };
    const Plant neighbour = at(1);
    const VariedSimulation varied = simulate_varied(plant, drive, options, {{.neighbour = &neighbour, .step = 1}});
    REQUIRE(varied.simulation.status == Status::ok);
    const Matrix difference =
        0.5 * (simulate_measured(at(1), drive, options).outputs - simulate_measured(at(-1), drive, options).outputs);
    REQUIRE(difference.norm() > 0);
    CHECK((varied.outputs[0] - difference).norm() < 2e-3 * difference.norm());
  }
}

TEST_CASE("an inerter is read, written and moved as any law, and refused where it would need a drive's acceleration") {
  Json text = Json::parse(quarter_car_text);
  text["elements"].push_back(Json::parse(
      R"({"name": "seat_mount", "between": ["ground", "body"], "laws": [{"law": "inerter", "inertance_kg": 4}]})"));
  const Plant plant = plant_from(text.dump());  // alone in its element
  CHECK(get_parameter(plant, "seat_mount.inerter.inertance_kg") == 4);
  CHECK(to_json(plant_from(to_json(plant).dump())) == to_json(plant));
  text["elements"][1]["laws"].push_back(Json::parse(R"({"law": "inerter", "inertance_kg": 4})"));
  CHECK_THROWS_WITH(plant_from(text.dump()), Contains("$.elements[1].laws") && Contains("acceleration"));
}
