// Stepping a quarter car: millions of Runge-Kutta steps a second, and what derivatives cost beside it.
#include "bench/against.hpp"
#include "core/base/random.hpp"
#include "core/plant/dataset.hpp"

namespace wheelhop::bench {
namespace {

constexpr Index kSteps = 40000;

/// A quarter car with an end stop (one tangent an evaluation) at 1 kHz, its outputs kept at 200 Hz.
struct QuarterCar {
  Plant plant = parse_plant(JsonCursor::from(parse_json(R"({
    "name": "quarter car",
    "masses": [{"name": "body", "mass_kg": 300}, {"name": "wheel", "mass_kg": 40}],
    "inputs": [{"name": "road", "kind": "displacement", "unit": "m", "hold_hz": 1000}],
    "elements": [
      {"name": "suspension", "between": ["wheel", "body"], "laws": [
        {"law": "hardening_spring", "stiffness_n_per_m": 18000, "alpha_per_m2": 1500, "beta_m": 0.02,
         "travel_limit_m": 0.09}, {"law": "viscous_damper", "damping_ns_per_m": 850}]},
      {"name": "tyre", "between": ["road", "wheel"], "laws": [{"law": "linear_spring", "stiffness_n_per_m": 200000}]}],
    "sensors": [{"name": "body_acc", "kind": "acceleration", "of": "body", "unit": "m/s^2"},
                {"name": "travel", "kind": "displacement", "between": ["wheel", "body"], "unit": "m"}]})",
                                                        "plant.json"),
                                             "plant.json"));
  std::vector<Matrix> drives;
  std::vector<Plant> neighbours;
  std::vector<Variation> variations;
  SimulateOptions options = {.decimation = 5};

  QuarterCar() {
    Random random(5, Stream::road);
    for (int lane = 0; lane < 4; ++lane) {
      drives.push_back(0.001 * random.normal(1, kSteps));
      for (Index k = 1; k < kSteps; ++k) drives.back()(k) += 0.95 * drives.back()(k - 1);
    }
    for (const PlantParameter& parameter : plant_parameters(plant)) {
      neighbours.push_back(plant);
      set_parameter(neighbours.back(), parameter.name, 1.0001 * parameter.value);
    }
    for (const Plant& neighbour : neighbours) variations.push_back({.neighbour = &neighbour});
  }
};

const QuarterCar& car() {
  static const QuarterCar made;
  return made;
}

void rate(benchmark::State& state, int simulations) {
  state.counters["million_steps_per_s"] =
      benchmark::Counter(1e-6 * static_cast<double>(kSteps) * simulations * static_cast<double>(state.iterations()),
                         benchmark::Counter::kIsRate);
}

}  // namespace

void add_stepping() {
  const std::string what = "quarter car, 40,000 steps";
  add_work(what, kOurs, "one simulation", [](benchmark::State& state) {
    for (auto _ : state) benchmark::DoNotOptimize(simulate(car().plant, car().drives[0], car().options).outputs.data());
    rate(state, 1);
  });
  add_work(what, kOurs, "four side by side", [](benchmark::State& state) {
    std::vector<SimulationTask> tasks;
    for (const Matrix& drive : car().drives) tasks.push_back({&car().plant, &drive, car().options});
    for (auto _ : state) benchmark::DoNotOptimize(simulate_side_by_side(tasks).data());
    rate(state, 4);
  });
  const std::string of = "derivatives in 8 parameters";
  add_work(what, kOurs, of, [](benchmark::State& state) {
    for (auto _ : state)
      benchmark::DoNotOptimize(
          simulate_varied(car().plant, car().drives[0], car().options, car().variations).outputs.data());
  });
  add_work(what, "differences", of, [](benchmark::State& state) {
    for (auto _ : state) {
      const Matrix here = simulate_measured(car().plant, car().drives[0], car().options).outputs;
      for (const Plant& neighbour : car().neighbours) {
        const Matrix change = (simulate_measured(neighbour, car().drives[0], car().options).outputs - here) / 1e-4;
        benchmark::DoNotOptimize(change.data());
      }
    }
  });
}

}  // namespace wheelhop::bench
