// Drives that accelerate the ground: a shaking table, an earthquake.
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "core/plant/dataset.hpp"
#include "core/plant/linearise.hpp"
#include "core/plant/simulate.hpp"
#include "tests/support/law_bench.hpp"
#include "tests/support/plants.hpp"
#include "tests/support/systems.hpp"

using namespace wheelhop;
using namespace wheelhop::test;
using Catch::Matchers::Contains;

namespace {

/// A smooth displacement of the ground and its derivatives.
struct Course {
  std::vector<double> amplitude_m, rad_per_s;
  double at(double t, int derivative) const {
    double sum = 0;
    for (std::size_t i = 0; i < amplitude_m.size(); ++i)
      sum += amplitude_m[i] * std::pow(rad_per_s[i], derivative) *
             std::sin(rad_per_s[i] * t + derivative * std::numbers::pi / 2);
    return sum;
  }
};

Course drawn_course(Random& random) {
  Course course;
  for (int i = 0; i < 5; ++i) {
    course.amplitude_m.push_back(1e-3 * (0.2 + random.uniform()));
    course.rad_per_s.push_back(2 * std::numbers::pi * (0.5 + 9 * random.uniform()));
  }
  return course;
}

/// The same plant on a table whose displacement is the drive.
Plant moved_table(Plant plant) {
  plant.inputs[0].kind = InputKind::displacement;
  plant.inputs[0].unit = "m";
  for (Element& element : plant.elements)
    if (element.from == "ground") element.from = "table";
  for (Sensor& sensor : plant.sensors)
    if (sensor.from == "ground" && sensor.kind != SensorKind::acceleration) sensor.from = "table";
  return plant;
}

}  // namespace

TEST_CASE("on a ground that accelerates a plant moves as on a table that is displaced as much") {
  Random random = numbers(6401);
  for (int trial = 0; trial < 5; ++trial) {
    const Course course = drawn_course(random);
    Plant shaken = plant_from(shaken_text);
    shaken.inputs[0].held = false;
    shaken.inputs[0].hold_hz = 2000;
    shaken.elements[0].laws.push_back(law_from(hysteresis_text));
    const Plant moved = moved_table(shaken);
    Matrix acceleration(1, 4000), displacement(1, 4000);
    for (Index k = 0; k < acceleration.cols(); ++k) {
      acceleration(k) = course.at(static_cast<double>(k) / 2000, 2);
      displacement(k) = course.at(static_cast<double>(k) / 2000, 0);
    }
    Vector start = Vector::Zero(4);  // at rest against the table
    start.tail(2).setConstant(course.at(0, 1));
    const Simulation one = simulate(shaken, acceleration, {.substeps = 4, .initial_state = Vector::Zero(4)});
    const Simulation other = simulate(moved, displacement, {.substeps = 4, .initial_state = start});
    REQUIRE(one.status == Status::ok);
    REQUIRE(other.status == Status::ok);
    for (Index i = 0; i < one.outputs.rows(); ++i) {
      CAPTURE(shaken.sensors[static_cast<std::size_t>(i)].name);
      // The curves through the samples differ near their ends.
      const auto kept = Eigen::seqN(10, 3900);
      CHECK((one.outputs(i, kept) - other.outputs(i, kept)).norm() < 1e-4 * other.outputs(i, kept).norm());
    }
  }
}

TEST_CASE("a table that accelerates steadily loads a plant as its weight would, and is felt by accelerometers") {
  const Plant plant = plant_from(shaken_text);
  const Simulation run = simulate(plant, Matrix::Constant(1, 400, -3.0), {.from_equilibrium = true});
  REQUIRE(run.status == Status::ok);
  const double x = run.outputs(0, 399);
  CHECK(9000 * x + 2e6 * x * x * x == Approx(3.0 * (5 + 3)));
  CHECK(run.outputs(1, 399) == Approx(-3));
  CHECK(run.outputs(2, 399) == Approx(-3));
  CHECK(std::abs(run.outputs(3, 399)) < 1e-9);
  CHECK(run.outputs(4, 399) == Approx(24));
}

TEST_CASE("the derivatives on a ground that accelerates are its differences, in masses, inertance, laws and drive") {
  Random random = numbers(6402);
  for (const bool inerter : {false, true}) {
    Plant plant = plant_from(shaken_text);
    if (inerter) plant.elements[0].laws.push_back(law_from(R"({"law": "inerter", "inertance_kg": 0.7})"));
    Matrix drive(1, 1500);
    double level = 0;
    for (Index k = 0; k < drive.cols(); ++k) drive(k) = level = 0.97 * level + random.normal();
    const SimulateOptions options{.substeps = 2, .decimation = 5};
    std::vector<std::string> names = {"actuator:table.gain"};
    for (const PlantParameter& parameter : plant_parameters(plant))
      if (parameter.value != 0) names.push_back(parameter.name);
    for (const std::string& name : names) {
      CAPTURE(name, inerter);
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
      for (Index i = 0; i < difference.rows(); ++i)
        CHECK((varied.outputs[0].row(i) - difference.row(i)).norm() <= 1e-3 * difference.row(i).norm());
    }
  }
}

TEST_CASE("the ground turns no mass: in pitch and roll a car's body feels its acceleration through its wheels alone") {
  Plant car = full_car();
  for (Element& element : car.elements)
    if (element.name.starts_with("tyre_")) element.from = "ground";
  car.inputs = {
      {.name = "table", .kind = InputKind::acceleration, .unit = "m/s^2", .hold_hz = 1000, .from = {}, .to = {}}};
  Motion motion(car);
  const double u = 2, u_rate = 0;
  motion.set_inputs(&u, &u_rate);
  const Vector zero = Vector::Zero(car.mass_count());
  Vector a(car.mass_count()), y(car.sensor_count());
  REQUIRE(motion.accelerations(zero.data(), zero.data(), a.data()) == Motion::all_defined);
  for (Index i = 0; i < a.size(); ++i) CHECK(a(i) == Approx(i == 1 || i == 2 ? 0 : -2));
  motion.outputs(zero.data(), zero.data(), a.data(), y.data());
  CHECK(y.cwiseAbs().maxCoeff() < 1e-12);  // what nothing holds stays where it is
}

TEST_CASE("a plant file takes one acceleration of the ground, and gives it back") {
  const Plant plant = plant_from(shaken_text);
  CHECK(to_json(parse_plant(JsonCursor::from(to_json(plant), "p"))) == to_json(plant));
  Json two = to_json(plant);
  two["inputs"].push_back({{"name", "other"}, {"kind", "acceleration"}, {"unit", "m/s^2"}, {"hold_hz", 1000}});
  CHECK_THROWS_WITH(parse_plant(JsonCursor::from(two, "p")), Contains("inputs[1].kind") && Contains("ground"));
  Json unit = to_json(plant);
  unit["inputs"][0]["unit"] = "m";
  CHECK_THROWS_WITH(parse_plant(JsonCursor::from(unit, "p")), Contains("inputs[0].unit") && Contains("m/s^2"));
}
