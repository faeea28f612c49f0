// The inner loop of a simulation: the equations in matrix form, and four simulations in the lanes of a vector register.
#include <catch2/catch.hpp>
#include <cmath>

#include "core/plant/simulate.hpp"
#include "core/plant/tan_inside.hpp"
#include "tests/support/law_bench.hpp"
#include "tests/support/plants.hpp"
#include "tests/support/systems.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

namespace {

/// Plants with each law of the catalogue, rigid points, forces between masses, and one to seven masses.
std::vector<Plant> plants() {
  std::vector<Plant> list = {plant_from(quarter_car_text), plant_from(chain_text), full_car(), plant_from(shaken_text)};
  for (const std::vector<Law>& laws : groups()) {
    Plant plant = plant_from(quarter_car_text);
    plant.elements[0].laws.insert(plant.elements[0].laws.end(), laws.begin(), laws.end());
    list.push_back(plant);
    plant = full_car();
    plant.elements[0].laws.insert(plant.elements[0].laws.end(), laws.begin(), laws.end());
    list.push_back(plant);
  }
  for (const char* text : {R"({"law": "backlash", "gap_m": 0.0004})", R"({"law": "liftoff", "static_load_n": 900})",
                           R"({"law": "rest_offset", "offset_m": 0.003})"}) {
    Plant plant = plant_from(quarter_car_text);
    plant.elements[1].laws.push_back(law_from(text));
    plant.elements[0].laws.push_back(law_from(text));
    list.push_back(plant);
  }
  return list;
}

Matrix drawn_drive(const Plant& plant, Index samples, Random& random) {
  Matrix drive(plant.input_count(), samples);
  Vector level(plant.input_count());
  for (Index i = 0; i < level.size(); ++i)
    level(i) = plant.inputs[static_cast<std::size_t>(i)].kind == InputKind::force ? 2.0 : 0.003;
  Vector state = Vector::Zero(plant.input_count());
  for (Index k = 0; k < samples; ++k) {
    state = 0.97 * state + 0.25 * random.normal(plant.input_count(), 1);
    drive.col(k) = level.cwiseProduct(state);
  }
  return drive;
}

/// The integrator as its definition has it, on the equations element by element.
Matrix states_by_definition(const Plant& plant, const Matrix& drive) {
  Motion motion(plant);
  const Index n = plant.mass_count(), m = plant.input_count(), s = motion.memories();
  const double h = 1 / plant.hold_hz();
  Vector x = Vector::Zero(2 * n + s), before = drive.col(0);
  Matrix states(2 * n + s, drive.cols());
  const auto slope = [&](const Vector& at) {
    Vector rate(2 * n + s), a(n), r(s);
    REQUIRE(motion.accelerations(at.data(), at.data() + n, at.data() + 2 * n, a.data(), r.data()) ==
            Motion::all_defined);
    rate << at.segment(n, n), a, r;
    return rate;
  };
  for (Index k = 0; k < drive.cols(); ++k) {
    const Vector step = drive.col(k) - before, rate = step / h;
    before = drive.col(k);
    motion.step_memories(step.data(), x.data() + 2 * n);
    motion.set_inputs(before.data(), m > 0 ? rate.data() : nullptr);
    states.col(k) = x;
    const Vector k1 = slope(x), k2 = slope(x + h / 2 * k1), k3 = slope(x + h / 2 * k2), k4 = slope(x + h * k3);
    x += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
  }
  return states;
}

void check_near(const Matrix& one, const Matrix& other, double share) {
  REQUIRE(one.rows() == other.rows());
  REQUIRE(one.cols() == other.cols());
  if (one.cols() == 0) return;
  for (Index i = 0; i < one.rows(); ++i)
    CHECK((one.row(i) - other.row(i)).cwiseAbs().maxCoeff() <= share * (1e-12 + other.row(i).cwiseAbs().maxCoeff()));
}

}  // namespace

TEST_CASE("the tangent between its poles: within 6 units in the last place, odd, and the same in each lane") {
  Random random = numbers(6100);
  for (int i = 0; i < 20000; ++i) {
    const double share = i % 2 ? 1 : std::pow(10.0, -12 * random.uniform());
    const double a = (2 * random.uniform() - 1) * share * 1.5707963267948966;
    const double exact = static_cast<double>(std::tan(static_cast<long double>(a)));
    const double unit = std::nextafter(std::abs(exact), 1e300) - std::abs(exact);
    CHECK(std::abs(tan_inside(a) - exact) <= 6 * unit);
    CHECK(tan_inside(-a) == -tan_inside(a));
    Lanes four = 0.25;
    four.set(2, a);
    CHECK(tan_inside(four)[2] == tan_inside(a));
    CHECK(tan_inside(four)[1] == tan_inside(0.25));
  }
}

TEST_CASE("a simulation is the Runge-Kutta method on the equations of its elements, whatever laws they have") {
  Random random = numbers(6101);
  for (const Plant& plant : plants()) {
    INFO(to_json(plant).dump());
    const Matrix drive = drawn_drive(plant, 400, random);
    const Simulation run = simulate(plant, drive);
    REQUIRE(run.status == Status::ok);
    check_near(run.states, states_by_definition(plant, drive), 1e-9);
  }
}

TEST_CASE("simulations side by side are those one after the other, each with its own status") {
  Random random = numbers(6102);
  for (const Plant& plant : plants()) {
    INFO(to_json(plant).dump());
    // Seven of one graph with other values, lengths and starts, and one of another graph between them.
    std::vector<Plant> cars(7, plant);
    std::vector<Matrix> drives;
    std::vector<SimulationTask> tasks;
    for (std::size_t i = 0; i < cars.size(); ++i) {
      if (i == 3)
        cars[i] = plant_from(one_mass_text);
      else
        for (const PlantParameter& parameter : plant_parameters(plant))
          if (parameter.range.low < parameter.value)
            set_parameter(cars[i], parameter.name, parameter.value * (1 + 0.02 * random.uniform()));
      drives.push_back(drawn_drive(cars[i], 150 + 50 * static_cast<Index>(4 * random.uniform()), random));
    }
    drives[1](0, 20) = std::nan("");
    for (std::size_t i = 0; i < cars.size(); ++i) {
      tasks.push_back({&cars[i], &drives[i], {.decimation = 5, .lead_samples = 10}});
      tasks.back().options.initial_state = 0.001 * random.normal(2 * cars[i].mass_count(), 1);
    }
    const std::vector<Simulation> together = simulate_side_by_side(tasks);
    REQUIRE(together.size() == tasks.size());
    for (std::size_t i = 0; i < tasks.size(); ++i) {
      const Simulation alone = simulate(cars[i], drives[i], tasks[i].options);
      CHECK(together[i].status == alone.status);
      CHECK(together[i].message == alone.message);
      CHECK(together[i].failure_time_s == alone.failure_time_s);
      check_near(together[i].states, alone.states, 1e-9);
      check_near(together[i].outputs, alone.outputs, 1e-9);
    }
    CHECK(together[1].status == Status::not_finite);
  }
}

TEST_CASE("a lane that leaves the domain of its laws ends at its own time, and the others go on") {
  const Plant plant = plant_from(quarter_car_text);
  Random random = numbers(6103);
  std::vector<Matrix> drives;
  for (int i = 0; i < 4; ++i) drives.push_back(drawn_drive(plant, 2000, random));
  drives[0].rightCols(1200).setConstant(0.4);
  drives[2].rightCols(700).setConstant(-0.4);
  std::vector<SimulationTask> tasks;
  for (const Matrix& drive : drives) tasks.push_back({&plant, &drive, {}});
  const std::vector<Simulation> together = simulate_side_by_side(tasks);
  for (std::size_t i = 0; i < 4; ++i) {
    const Simulation alone = simulate(plant, drives[i]);
    CHECK(alone.status == (i % 2 ? Status::ok : Status::outside_domain));
    CHECK(together[i].status == alone.status);
    CHECK(together[i].message == alone.message);
    CHECK(together[i].failure_time_s == alone.failure_time_s);
    check_near(together[i].outputs, alone.outputs, 1e-9);
  }
  CHECK(together[0].failure_time_s < together[2].failure_time_s);
}
