/// \file
/// Plants with a record and its operation, for tests of what effect families offer.
#pragma once

#include <catch2/catch.hpp>
#include <cmath>
#include <string>
#include <vector>

#include "core/greybox/operation.hpp"
#include "core/plant/simulate.hpp"
#include "tests/support/plants.hpp"

namespace wheelhop::test {

/// A plant, what it reads under a drive, and how it moves then.
struct Case {
  Plant plant;
  FitRecord record;
  Vector rest;
  Operation operation;
};

/// A smooth drive from rest, small enough for every plant and every end stop.
inline Case make_case(const std::string& text, double level) {
  Case c;
  c.plant = plant_from(text);
  const Index ratio = 5, samples = 200;
  c.record.drive = Matrix::Zero(c.plant.input_count(), samples * ratio);
  for (Index i = 0; i < c.plant.input_count(); ++i)
    for (Index k = 0; k < samples * ratio; ++k) {
      const double t = static_cast<double>(k) / c.plant.hold_hz();
      const InputKind kind = c.plant.inputs[static_cast<std::size_t>(i)].kind;
      const double unit = kind == InputKind::force ? 1000 : kind == InputKind::schedule ? 300 : 1;
      c.record.drive(i, k) =
          unit * level *
          (std::sin(9 * t + static_cast<double>(i)) - std::sin(static_cast<double>(i)) + 0.3 * std::sin(50 * t));
    }
  c.record.ratio = ratio;
  c.record.y = Matrix::Zero(c.plant.sensor_count(), samples);
  c.record.weight_std = Vector::Ones(c.plant.sensor_count());
  c.rest = Vector::Zero(2 * c.plant.mass_count());
  const Simulation still = simulate(c.plant, c.record.drive, {.decimation = ratio});
  c.record.y = still.outputs;
  c.record.quantum = 0.01 * c.record.y.rowwise().norm();
  REQUIRE(operation_of(c.plant, {c.record}, {c.rest}, c.operation));
  return c;
}

/// A quarter car, one mass, a chain of three, and a quarter car whose damper follows a voltage.
inline std::vector<Case> cases() {
  return {make_case(quarter_car_text, 0.005), make_case(one_mass_text, 0.002), make_case(chain_text, 0.002),
          make_case(semi_active_text, 0.005)};
}

}  // namespace wheelhop::test
