// The common factor of all forces: motion does not tell it, priors do.
#include <catch2/catch.hpp>
#include <cmath>

#include "core/greybox/force_scale.hpp"
#include "core/plant/simulate.hpp"
#include "tests/support/plants.hpp"
#include "tests/support/systems.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

namespace {

/// The plant with theta of its tolerances.
Plant moved(const Plant& start, const std::vector<FitParameter>& parameters, const Vector& theta) {
  Plant plant = start;
  for (std::size_t i = 0; i < parameters.size(); ++i)
    set_parameter(plant, parameters[i].name,
                  get_parameter(start, parameters[i].name) + theta(static_cast<Index>(i)) * parameters[i].scale);
  return plant;
}

/// What the sensors read of a drive; empty where the plant does not follow it.
Matrix readings(const Plant& plant, const Matrix& drive) {
  const Simulation run = simulate(plant, drive, {.substeps = stable_substeps(plant)});
  return run.status == Status::ok ? run.outputs : Matrix();
}

double prior(const Vector& theta) { return theta.squaredNorm(); }

}  // namespace

TEST_CASE("a plant whose forces all went off by one factor comes home, and reads what it read") {
  Random random = numbers(9201);
  Plant start = plant_from(quarter_car_text);
  start.elements[0].laws.push_back({find_law("coulomb_friction"), {40, 0, 0.05, 0.005}});
  const std::vector<FitParameter> parameters = tolerance_parameters(start);
  Matrix drive(1, 2000);
  for (Index k = 0; k < drive.cols(); ++k) drive(k) = 0.004 * std::sin(0.02 * static_cast<double>(k));
  for (int trial = 0; trial < 8; ++trial) {
    const double factor = std::exp(0.3 * random.normal());
    CAPTURE(trial, factor);
    Vector off(static_cast<Index>(parameters.size()));
    for (Index i = 0; i < off.size(); ++i) off(i) = 0.3 * random.normal();
    const Plant near = moved(start, parameters, off);
    Vector scaled = off;
    for (Index i = 0; i < off.size(); ++i) {
      const FitParameter& own = parameters[static_cast<std::size_t>(i)];
      const bool of_force = own.name.ends_with("_kg") || own.name.ends_with("stiffness_n_per_m") ||
                            own.name.ends_with("damping_ns_per_m") || own.name.ends_with("force_n");
      if (of_force) scaled(i) = (factor * get_parameter(near, own.name) - get_parameter(start, own.name)) / own.scale;
    }
    const Plant far = moved(start, parameters, scaled);
    const Matrix before = readings(near, drive), after = readings(far, drive);
    REQUIRE(before.cols() == drive.cols());
    CHECK((after - before).norm() < 1e-9 * before.norm());  // motion tells nothing of the factor

    const Vector home = with_force_scale_at_home(far, start, parameters, scaled);
    CHECK(prior(home) <= prior(off) * (1 + 1e-12));  // the least of all factors, that of `off` among them
    const Matrix there = readings(moved(start, parameters, home), drive);
    CHECK((there - before).norm() < 1e-9 * before.norm());
    CHECK((with_force_scale_at_home(moved(start, parameters, home), start, parameters, home) - home).norm() < 1e-9);
  }
}

TEST_CASE("where the records tell forces, or what belongs to them is not fitted, their factor stays") {
  const Plant car = plant_from(quarter_car_text);
  const auto stays = [](const Plant& start, std::vector<FitParameter> parameters) {
    Vector theta = Vector::Constant(static_cast<Index>(parameters.size()), 3);
    return with_force_scale_at_home(moved(start, parameters, theta), start, parameters, theta) == theta;
  };
  CHECK_FALSE(stays(car, tolerance_parameters(car)));
  Plant weighed = car;
  weighed.sensors.push_back({"cell", SensorKind::force, "", "", "N", {}, "tyre"});
  CHECK(stays(weighed, tolerance_parameters(weighed)));
  std::vector<FitParameter> some = tolerance_parameters(car);
  some.erase(some.begin());
  CHECK(stays(car, some));

  Plant pushed = car;
  PlantInput force;
  force.name = "push";
  force.kind = InputKind::force;
  force.unit = "N";
  force.to = "body";
  force.hold_hz = car.hold_hz();
  pushed.inputs.push_back(force);
  CHECK(stays(pushed, tolerance_parameters(pushed)));
  pushed.inputs[1].path.gain = 0.7;  // a fitted factor of the drive goes with them
  std::vector<FitParameter> all = tolerance_parameters(pushed);
  for (FitParameter& own : all)
    if (own.name == "actuator:push.gain") own.prior_std = 0;
  CHECK_FALSE(stays(pushed, all));
  pushed.inputs[1].path.saturation = 30;
  CHECK(stays(pushed, all));
}
