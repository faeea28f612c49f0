// Sensors of the force in an element, elements on a dynamometer, and constant loads.
#include <catch2/catch.hpp>
#include <cmath>

#include "core/plant/dataset.hpp"
#include "core/plant/linearise.hpp"
#include "core/plant/simulate.hpp"
#include "tests/support/law_bench.hpp"
#include "tests/support/places.hpp"
#include "tests/support/plants.hpp"
#include "tests/support/systems.hpp"

using namespace wheelhop;
using namespace wheelhop::test;
using Catch::Contains;

namespace {

Sensor cell_in(const std::string& element) { return {"cell_" + element, SensorKind::force, "", "", "N", {}, element}; }

/// The plant with a force sensor in every element.
Plant with_cells(Plant plant) {
  for (const Element& element : plant.elements) plant.sensors.push_back(cell_in(element.name));
  return plant;
}

/// Laws of each kind, those with memory, those that bound or shift others, and an inerter.
std::vector<std::vector<Law>> all_groups() {
  std::vector<std::vector<Law>> list = groups();
  for (const char* text : {R"({"law": "backlash", "gap_m": 0.0004})", R"({"law": "liftoff", "static_load_n": 60})",
                           R"({"law": "rest_offset", "offset_m": 0.003})", R"({"law": "inerter", "inertance_kg": 3})"})
    list.push_back({law_from(text)});
  return list;
}

Matrix smooth_drive(const Plant& plant, Index samples, Random& random) {
  Matrix drive(plant.input_count(), samples);
  for (Index i = 0; i < drive.rows(); ++i) {
    const double slow = 5 + 10 * random.uniform(), fast = 40 + 40 * random.uniform(), phase = 6 * random.uniform();
    const double unit = plant.inputs[static_cast<std::size_t>(i)].kind == InputKind::force ? 5000 : 1;
    for (Index k = 0; k < samples; ++k) {
      const double t = static_cast<double>(k) / plant.hold_hz();
      drive(i, k) = 0.004 * unit * (std::sin(slow * t + phase) - std::sin(phase) + 0.3 * std::sin(fast * t));
    }
  }
  return drive;
}

/// A damper between a moving head and the ground, and nothing that has a mass.
Plant dynamometer(const std::vector<Law>& laws) {
  Plant plant = plant_from(R"({
    "name": "dynamometer",
    "inputs": [{"name": "stroke", "kind": "displacement", "unit": "m", "hold_hz": 1000}],
    "elements": [{"name": "damper", "between": ["ground", "stroke"],
                  "laws": [{"law": "viscous_damper", "damping_ns_per_m": 900}]}],
    "sensors": [{"name": "cell", "kind": "force", "element": "damper", "unit": "N"}]})");
  plant.elements[0].laws.insert(plant.elements[0].laws.end(), laws.begin(), laws.end());
  return plant;
}

/// Largest difference of each row over its largest value.
double row_difference(const Matrix& one, const Matrix& other) {
  double most = 0;
  for (Index i = 0; i < one.rows(); ++i)
    most = std::max(most, (one.row(i) - other.row(i)).norm() / (1e-12 + other.row(i).norm()));
  return most;
}

}  // namespace

TEST_CASE("the force that a sensor reads in the only element at a mass is the mass times its acceleration") {
  Random random = numbers(6301);
  for (const std::vector<Law>& laws : all_groups())
    for (const bool turned : {false, true}) {
      Plant plant = plant_from(one_mass_text);
      plant.masses[0].mass_kg = 1 + 4 * random.uniform();
      plant.elements[0].laws.insert(plant.elements[0].laws.end(), laws.begin(), laws.end());
      if (turned) std::swap(plant.elements[0].from, plant.elements[0].to);
      plant = with_cells(plant);
      const double load = turned ? 12 * random.normal() : 0;
      if (turned) plant.loads.push_back({"weight", "m", load});
      INFO(to_json(plant).dump());
      const Matrix drive = smooth_drive(plant, 600, random);
      const Simulation run = simulate(plant, drive, {.substeps = 16});
      REQUIRE(run.status == Status::ok);
      const Eigen::RowVectorXd inertia = plant.masses[0].mass_kg * run.outputs.row(2), force = run.outputs.row(3);
      // A positive force pulls the second node toward the first: the mass down to the ground, or the ground up.
      const Eigen::RowVectorXd others = drive.row(0).array() + load;
      CHECK((inertia - others - (turned ? 1 : -1) * force).norm() < 1e-9 * (1 + others.norm()));
      CHECK(force.norm() > 1);
    }
}

TEST_CASE("a force sensor's linear reading is the derivative of its reading, memories, points and inerters included") {
  Random random = numbers(6302);
  for (const Plant& base : {plant_from(quarter_car_text), plant_from(chain_text), full_car()}) {
    Plant plant = with_cells(base);
    for (std::size_t e = 0; e < plant.elements.size(); ++e) {
      Element& element = plant.elements[e];
      for (const std::string& law : {friction_text, hysteresis_text}) element.laws.push_back(law_from(law));
      element.laws.push_back(law_from(R"({"law": "backlash", "gap_m": 0.001})"));
      if (base.name == "chain" ? e > 0 : element.name.starts_with("s"))
        element.laws.push_back(law_from(R"({"law": "inerter", "inertance_kg": 2})"));
    }
    plant.loads.push_back({"weight", plant.masses[0].name, -300});
    INFO(plant.name);
    Motion motion(plant);
    const Index n = motion.masses(), s = motion.memories(), m = motion.inputs(), p = motion.sensors(), N = 2 * n + s;
    Vector point = Vector::Zero(N + 2 * m);
    point.head(N) << 0.01 * random.normal(n, 1), random.normal(n, 1), 0.3 * random.normal(s, 1);
    point.segment(N, m) = 0.01 * random.normal(m, 1);
    const LinearPlant model = linearise(plant, point.head(N), point.segment(N, m));
    Matrix analytic(p, N + 2 * m);
    analytic << model.C, model.D, model.D_rate;
    const auto readings = [&](const Vector& at) {
      Vector a(n), z_rate(s), y(p);
      motion.set_inputs(&at(N), &at(N + m));
      REQUIRE(motion.accelerations(at.data(), at.data() + n, at.data() + 2 * n, a.data(), z_rate.data()) ==
              Motion::all_defined);
      motion.outputs(at.data(), at.data() + n, at.data() + 2 * n, a.data(), y.data());
      return y;
    };
    for (Index j = 0; j < N + 2 * m; ++j) {
      CAPTURE(j);
      Vector up = point, down = point;
      up(j) += 1e-6;
      down(j) -= 1e-6;
      const Vector numerical = (readings(up) - readings(down)) / 2e-6;
      CHECK((numerical - analytic.col(j)).cwiseAbs().maxCoeff() <=
            1e-4 * std::max(1.0, numerical.cwiseAbs().maxCoeff()));
    }
  }
}

TEST_CASE("the derivatives of a simulated force are its differences, in laws, masses, loads and drives") {
  Random random = numbers(6303);
  Plant plant = with_cells(plant_from(quarter_car_text));
  for (const std::string& law : {hysteresis_text, maxwell_text}) plant.elements[0].laws.push_back(law_from(law));
  plant.elements[0].laws.push_back(law_from(R"({"law": "inerter", "inertance_kg": 9})"));
  plant.elements[1].laws.push_back(law_from(R"({"law": "liftoff", "static_load_n": 40000})"));
  plant.loads = {{"weight", "body", -250}, {"preload", "wheel", 90}};
  plant.inputs.push_back({"push", InputKind::force, "N", 1000, "zoh", "ground", "body"});
  const Matrix drive = smooth_drive(plant, 1500, random);
  const SimulateOptions options{.substeps = 2, .decimation = 5};
  std::vector<std::string> names = {"actuator:road.gain", "actuator:push.gain"};
  for (const PlantParameter& parameter : plant_parameters(plant)) names.push_back(parameter.name);
  CHECK(std::count(names.begin(), names.end(), "load:weight.force_n") == 1);
  for (const std::string& name : names) {
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
    if (name.find("static_load_n") != std::string::npos) {
      CHECK(difference.norm() == 0);  // the contact holds
      CHECK(varied.outputs[0].norm() < 1e-9);
      continue;
    }
    CHECK(row_difference(varied.outputs[0], difference) < 2e-2);
  }
  // An initial state, too.
  Vector start = Vector::Zero(4);
  start(0) = 1e-6;
  SimulateOptions moved = options;
  moved.initial_state = start;
  const VariedSimulation varied = simulate_varied(plant, drive, options, {{.step = 1, .initial = start}});
  CHECK(row_difference(varied.outputs[0], simulate_measured(plant, drive, moved).outputs -
                                              simulate_measured(plant, drive, options).outputs) < 2e-2);
}

TEST_CASE("forces and loads side by side in lanes are those of one simulation after the other") {
  Random random = numbers(6304);
  for (const Plant& base : {plant_from(quarter_car_text), full_car(), dynamometer({law_from(friction_text)})}) {
    INFO(base.name);
    std::vector<Plant> plants;
    for (int i = 0; i < 5; ++i) {
      Plant own = base.masses.empty() ? base : with_cells(base);
      for (const PlantParameter& parameter : plant_parameters(base))
        if (parameter.range.low < parameter.value)
          set_parameter(own, parameter.name, parameter.value * (1 + 0.02 * random.uniform()));
      if (i > 0 && !base.masses.empty()) own.loads.push_back({"weight", own.masses[0].name, 50 * random.normal()});
      if (i > 1 && !base.points.empty()) own.loads.push_back({"luggage", own.points[0].name, 80 * random.normal()});
      plants.push_back(std::move(own));
    }
    const Matrix drive = smooth_drive(base, 400, random);
    std::vector<SimulationTask> tasks;
    for (const Plant& own : plants) tasks.push_back({&own, &drive, {.decimation = 4}});
    const std::vector<Simulation> together = simulate_side_by_side(tasks);
    for (std::size_t i = 0; i < plants.size(); ++i) {
      const Simulation alone = simulate(plants[i], drive, tasks[i].options);
      REQUIRE(alone.status == Status::ok);
      CHECK(row_difference(together[i].outputs, alone.outputs) < 1e-9);
    }
  }
}

TEST_CASE(
    "a damper on a dynamometer needs no mass: its force is that of its laws at the travel and rate of the drive") {
  Random random = numbers(6305);
  const double hold_s = 1e-3;
  for (const std::vector<Law>& laws : groups()) {
    if (std::any_of(laws.begin(), laws.end(), [](const Law& law) { return law.states() > 0; })) continue;
    Plant plant = dynamometer(laws);
    const bool turned = random.uniform() < 0.5;
    if (turned) std::swap(plant.elements[0].from, plant.elements[0].to);
    INFO(to_json(plant).dump());
    const Matrix drive = smooth_drive(plant, 300, random);
    const Simulation run = simulate(plant, drive, {.from_equilibrium = true});
    REQUIRE(run.status == Status::ok);
    CHECK(run.states.rows() == 0);
    REQUIRE(run.outputs.cols() == 300);
    const double sign = turned ? -1 : 1;
    for (Index k = 1; k < 300; ++k) {
      const double x = sign * drive(0, k), v = sign * (drive(0, k) - drive(0, k - 1)) / hold_s;
      double sum = 0, f = 0;
      for (const Law& law : plant.elements[0].laws) {
        REQUIRE(law.force(x, v, f));
        sum += f;
      }
      CHECK(run.outputs(0, k) == Approx(sum).epsilon(1e-9).margin(1e-9));
    }
  }
}

TEST_CASE("without a mass memories go on as beside one that does not give way, in derivatives and linearised as well") {
  Random random = numbers(6306);
  for (const std::string& text : {hysteresis_text, maxwell_text}) {
    const Plant plant = dynamometer({law_from(text)});
    CAPTURE(text);
    Plant held = plant;
    held.masses.push_back({"wall", 1e12});
    held.elements[0].from = "wall";
    const Matrix drive = smooth_drive(plant, 500, random);
    const SimulateOptions options{.substeps = 4};
    const Simulation run = simulate(plant, drive, options);
    REQUIRE(run.status == Status::ok);
    CHECK(row_difference(run.outputs, simulate(held, drive, options).outputs) < 1e-6);
    for (const PlantParameter& parameter : plant_parameters(plant)) {
      CAPTURE(parameter.name);
      const double step = 1e-4 * parameter.value;
      Plant up = plant, down = plant;
      set_parameter(up, parameter.name, parameter.value + step);
      set_parameter(down, parameter.name, parameter.value - step);
      const VariedSimulation varied = simulate_varied(plant, drive, options, {{.neighbour = &up, .step = 1}});
      const Matrix difference =
          0.5 * (simulate_measured(up, drive, options).outputs - simulate_measured(down, drive, options).outputs);
      CHECK(row_difference(varied.outputs[0], difference) < 2e-2);
    }
    const LinearPlant model = linearise(plant), wall = linearise(held);
    REQUIRE(model.status == Status::ok);
    CHECK(model.A.rows() == 1);
    CHECK((model.C - wall.C.rightCols(1)).norm() < 1e-6 * wall.C.norm());
    CHECK((model.D - wall.D).norm() + (model.D_rate - wall.D_rate).norm() <
          1e-6 * (wall.D.norm() + wall.D_rate.norm()));
  }
  const LinearPlant rigid = linearise(dynamometer({}));
  CHECK(rigid.status == Status::ok);
  CHECK(rigid.D_rate(0, 0) == Approx(900));
  CHECK(rigid.D(0, 0) == 0);
  CHECK(modes(rigid.A).empty());
}

TEST_CASE("an element between two drives feels the difference of what they do") {
  Random random = numbers(6307);
  for (const std::vector<Law>& laws : groups()) {
    const Plant one = dynamometer(laws);
    Plant two = one;
    two.inputs.push_back(two.inputs[0]);
    two.inputs[1].name = "base";
    two.elements[0].from = "base";
    INFO(to_json(two).dump());
    const Matrix drives = smooth_drive(two, 400, random);
    const Matrix difference = drives.row(0) - drives.row(1);
    const SimulateOptions options{.substeps = 4};
    const Simulation apart = simulate(two, drives, options), single = simulate(one, difference, options);
    REQUIRE(apart.status == Status::ok);
    CHECK(row_difference(apart.outputs, single.outputs) < 1e-7);
    // A stronger base drive is a change of the difference by -base.
    Plant neighbour = two;
    neighbour.inputs[1].path.gain = 1 + 1e-5;
    const VariedSimulation varied = simulate_varied(two, drives, options, {{.neighbour = &neighbour, .step = 1}});
    const Matrix change = drives.row(0) - (1 + 1e-5) * drives.row(1);
    CHECK(row_difference(varied.outputs[0], simulate(one, change, options).outputs - single.outputs) < 2e-2);
    const LinearPlant model = linearise(two), alone = linearise(one);
    CHECK((model.D.col(0) - alone.D.col(0)).norm() + (model.D.col(1) + alone.D.col(0)).norm() == 0);
    CHECK((model.D_rate.col(0) - alone.D_rate.col(0)).norm() + (model.D_rate.col(1) + alone.D_rate.col(0)).norm() == 0);
  }
}

TEST_CASE("a force of an input inside an element is read as a law's, beside it is not") {
  Plant plant = with_cells(plant_from(quarter_car_text));
  PlantInput push{"push", InputKind::force, "N", 1000, "zoh", "wheel", "body"};
  plant.inputs.push_back(push);
  Plant inside = plant;
  inside.inputs[1].inside = "suspension";
  Random random = numbers(6308);
  const Matrix drive = smooth_drive(plant, 300, random);
  const Simulation beside = simulate(plant, drive), within = simulate(inside, drive);
  CHECK((beside.states - within.states).norm() == 0);
  CHECK((beside.outputs.topRows(3) - within.outputs.topRows(3)).norm() == 0);
  // It pushes the body away from the wheel, a law of positive force pulls it near.
  CHECK((within.outputs.row(3) - beside.outputs.row(3) + drive.row(1)).norm() < 1e-9 * drive.row(1).norm());
  const LinearPlant model = linearise(inside), without = linearise(plant);
  CHECK(model.D(3, 1) == Approx(without.D(3, 1) - 1));
  // Newton for the body: all that its only element does, and nothing else.
  CHECK((300 * within.outputs.row(1) + within.outputs.row(3)).norm() < 1e-9 * within.outputs.row(3).norm());
}

TEST_CASE("a load shifts the equilibrium by the force over the stiffness, on a point by what the point moves by") {
  Random random = numbers(6309);
  for (int trial = 0; trial < 10; ++trial) {
    const double k = 500 + 5000 * random.uniform(), force = 30 * random.normal();
    Plant plant = plant_from(one_mass_text);
    plant.elements[0].laws = {{find_law("linear_spring"), {k}}, {find_law("viscous_damper"), {4}}};
    plant.loads = {{"weight", "m", force}};
    const Equilibrium rest = static_equilibrium(plant, Vector::Zero(1));
    REQUIRE(rest.status == Status::ok);
    CHECK(rest.positions(0) == Approx(force / k).epsilon(1e-12));
    // At rest there it stays at rest, and the spring carries it.
    plant = with_cells(plant);
    const Simulation run = simulate(plant, Matrix::Zero(1, 100), {.from_equilibrium = true});
    CHECK((run.outputs.row(0).array() - force / k).abs().maxCoeff() < 1e-12);
    CHECK((run.outputs.row(3).array() - force).abs().maxCoeff() < 1e-9 * std::abs(force));
    // A load is a force input that is constant.
    Plant pushed = plant;
    pushed.loads.clear();
    const Simulation input = simulate(pushed, Matrix::Constant(1, 100, force)),
                     load = simulate(plant, Matrix::Zero(1, 100));
    CHECK(row_difference(load.outputs, input.outputs) < 1e-10);
  }
  Plant car = full_car(), same = car;
  car.loads = {{"luggage", "corner_rl", -400}};
  // 1 of heave, 1.5 of pitch, -0.7 or 0.7 of roll: the same forces on the masses that carry the point.
  for (const auto& [mass, weight] : car.points[2].weights) same.loads.push_back({mass, mass, -400 * weight});
  REQUIRE(car.points[2].name == "corner_rl");
  const Vector none = Vector::Zero(car.input_count());
  const Equilibrium one = static_equilibrium(car, none), other = static_equilibrium(same, none);
  REQUIRE(one.status == Status::ok);
  CHECK((one.positions - other.positions).norm() < 1e-7 * other.positions.norm());
  CHECK(one.positions(car.node("wheel_rl")) < 0);
}

TEST_CASE("plants with force sensors and loads are read, written, and refused where they are wrong") {
  Json text = Json::parse(quarter_car_text);
  text["loads"] = Json::parse(R"([{"name": "gravity", "on": "body", "force_n": -2450, "tolerance": 0.01},
                                  {"name": "brake", "on": "wheel", "force_n": 30}])");
  text["sensors"].push_back(
      Json::parse(R"({"name": "cell", "kind": "force", "element": "tyre", "unit": "N", "bias": 3})"));
  const Plant plant = plant_from(text.dump());
  CHECK(plant.sensors[3].kind == SensorKind::force);
  CHECK(to_json(plant_from(to_json(plant).dump())) == to_json(plant));
  const Plant bench = dynamometer({});
  CHECK(bench.mass_count() == 0);
  CHECK(to_json(plant_from(to_json(bench).dump())) == to_json(bench));
  const std::vector<PlantParameter> list = plant_parameters(plant);
  const auto gravity = std::find_if(list.begin(), list.end(),
                                    [](const PlantParameter& own) { return own.name == "load:gravity.force_n"; });
  REQUIRE(gravity != list.end());
  CHECK(gravity->value == -2450);
  CHECK(gravity->tolerance == 0.01);
  CHECK(gravity->handle.place == "guide:body"_at);
  CHECK(gravity->unit == "N");

  const auto refusal = [&](const auto& edit) -> std::string {
    Json wrong = text;
    edit(wrong);
    try {
      plant_from(wrong.dump());
    } catch (const UserError& error) {
      return error.what();
    }
    return "accepted";
  };
  CHECK(refusal([](Json&) {}) == "accepted");
  CHECK_THAT(refusal([](Json& p) { p["sensors"][3]["element"] = "tire"; }),
             Contains("$.sensors[3].element") && Contains("tyre"));
  CHECK_THAT(refusal([](Json& p) { p["sensors"][3]["of"] = "body"; }), Contains("$.sensors[3]") && Contains("of"));
  CHECK_THAT(refusal([](Json& p) { p["sensors"][3]["unit"] = "kN"; }), Contains("$.sensors[3].unit") && Contains("N"));
  CHECK_THAT(refusal([](Json& p) { p["sensors"][0]["element"] = "tyre"; }), Contains("$.sensors[0]"));
  CHECK_THAT(refusal([](Json& p) { p["loads"][0]["on"] = "road"; }), Contains("$.loads[0].on") && Contains("body"));
  CHECK_THAT(refusal([](Json& p) { p["loads"][1]["name"] = "gravity"; }), Contains("$.loads[1].name"));
  CHECK_THAT(refusal([](Json& p) { p["loads"][0].erase("force_n"); }), Contains("$.loads[0]") && Contains("force_n"));
  CHECK_THAT(refusal([](Json& p) { p["loads"][0]["tolerance"] = 0; }), Contains("$.loads[0].tolerance"));
  // Between two held nodes an element has to be read.
  const auto held = [](Json& p) {
    p["elements"].push_back(p["elements"][1]);
    p["elements"][2]["name"] = "post";
    p["elements"][2]["between"] = {"ground", "road"};
  };
  CHECK_THAT(refusal(held), Contains("$.elements[2].between") && Contains("force"));
  CHECK(refusal([&](Json& p) {
          held(p);
          p["sensors"][3]["element"] = "post";
        }) == "accepted");
}
