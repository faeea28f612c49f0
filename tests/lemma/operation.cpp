// The ranges that a plant runs through, and masses that an initial state does not know.
#include <catch2/catch.hpp>
#include <cmath>

#include "core/greybox/operation.hpp"
#include "core/plant/dataset.hpp"
#include "tests/support/plants.hpp"
#include "tests/support/systems.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

TEST_CASE("operation: travel, rate and force of an element are those of its motion, a drive's those of the command") {
  const Plant plant = plant_from(quarter_car_text);
  FitRecord record;
  record.ratio = 5;
  record.drive.resize(1, 20000);
  const double w = 2 * M_PI * 2, hold_hz = plant.hold_hz();
  for (Index k = 0; k < record.drive.cols(); ++k)
    record.drive(0, k) = 0.004 * std::sin(w * static_cast<double>(k) / hold_hz);
  record.y = Matrix::Zero(3, 4000);
  record.weight_std = Vector::Ones(3);
  record.quantum = (Vector(3) << 0, 0.1, 0).finished();
  Operation operation;
  REQUIRE(operation_of(plant, {record}, {}, operation));
  CHECK(operation.drive_peak(0) == Approx(0.004).epsilon(1e-4));
  CHECK(operation.drive_rate_peak(0) == Approx(0.004 * w).epsilon(1e-3));
  CHECK(operation.output_quantum == record.quantum);
  CHECK(operation.output_ceiling == Vector::Zero(3));
  CHECK((operation.output_peak.array() >= operation.output_rms.array()).all());
  CHECK(operation.output_rate_peak(0) == Approx(w * operation.output_peak(0)).epsilon(0.15));  // nearly a sine
  REQUIRE(operation.elements.size() == 2);
  const ElementOperation& strut = operation.elements[0];
  CHECK(strut.travel_low_m < 0);
  CHECK(strut.travel_high_m > 0);
  CHECK(strut.rate_rms_m_per_s == Approx(w * strut.travel_rms_m).epsilon(0.1));  // nearly a sine
  CHECK(strut.force_rms_n > 0);
  CHECK(strut.force_high_n > strut.force_rms_n);

  // Twice the drive, twice the range, but for the hardening of the spring.
  record.drive *= 2;
  Operation twice;
  REQUIRE(operation_of(plant, {record}, {}, twice));
  CHECK(twice.elements[1].travel_rms_m == Approx(2 * operation.elements[1].travel_rms_m).epsilon(0.35));
  record.drive *= 1000;
  CHECK_FALSE(operation_of(plant, {record}, {}, twice));
}

TEST_CASE("operation: a guide feels the mass's own motion and the force that moves it") {
  Plant plant = plant_from(quarter_car_text);
  plant.sensors.push_back({"body_pos", SensorKind::displacement, "ground", "body", "m"});
  FitRecord record;
  record.ratio = 5;
  record.drive.resize(1, 20000);
  for (Index k = 0; k < record.drive.cols(); ++k)
    record.drive(0, k) = 0.004 * std::sin(2 * M_PI * 2 * static_cast<double>(k) / plant.hold_hz());
  record.y = Matrix::Zero(4, 4000);
  record.weight_std = Vector::Ones(4);
  Operation operation;
  REQUIRE(operation_of(plant, {record}, {}, operation));
  REQUIRE(operation.guides.size() == 2);
  const ElementOperation& body = operation.guides[0];
  CHECK(body.travel_rms_m == Approx(operation.output_rms(3)));
  CHECK(std::max(body.travel_high_m, -body.travel_low_m) == Approx(operation.output_peak(3)));
  CHECK(body.force_rms_n == Approx(300 * operation.output_rms(1)).epsilon(1e-6));
  CHECK(body.rate_rms_m_per_s == Approx(2 * M_PI * 2 * body.travel_rms_m).epsilon(0.1));  // nearly a sine
  // All of what moves the body comes through the suspension.
  CHECK(body.force_rms_n == Approx(operation.elements[0].force_rms_n).epsilon(1e-6));
}

TEST_CASE("operation: readings that end at one size again and again tell where a sensor's range ends") {
  const Plant plant = plant_from(quarter_car_text);
  FitRecord record;
  record.ratio = 5;
  record.drive.resize(1, 4000);
  for (Index k = 0; k < record.drive.cols(); ++k)
    record.drive(0, k) = 0.004 * std::sin(2 * M_PI * 2 * static_cast<double>(k) / plant.hold_hz());
  record.weight_std = Vector::Ones(3);
  Random random = numbers(641);
  record.y = random.normal(3, 800);
  record.y.row(1) = record.y.row(1).cwiseMax(-1.2).cwiseMin(1.2).eval();
  Operation operation;
  REQUIRE(operation_of(plant, {record}, {}, operation));
  CHECK(operation.output_ceiling == (Vector(3) << 0, 1.2, 0).finished());
  record.y.resize(0, 0);  // a test that is only planned
  REQUIRE(operation_of(plant, {record}, {}, operation));
  CHECK(operation.output_ceiling == Vector::Zero(3));
}

TEST_CASE("a mass that an initial state does not know starts with the mass it hangs on") {
  Plant plant = plant_from(quarter_car_text);
  const Vector state = (Vector(4) << 0.01, 0.002, -0.3, 0.4).finished();
  CHECK(whole_state(plant, state) == state);
  plant.masses.push_back({"seat", 5});
  plant.elements.push_back({"cushion", "body", "seat", plant.elements[1].laws});
  const Vector whole = whole_state(plant, state);
  REQUIRE(whole.size() == 6);
  CHECK(whole == (Vector(6) << 0.01, 0.002, 0.01, -0.3, 0.4, -0.3).finished());
}
