// Gross faults of instruments: what a plant as delivered tells of channels in another unit or of another sign, of
// accelerometers that carry gravity, and of clocks.
#include <catch2/catch.hpp>
#include <cmath>

#include "core/gap/evidence/instrument_faults.hpp"
#include "core/gap/verdict/faults.hpp"
#include "core/plant/dataset.hpp"
#include "tests/support/places.hpp"
#include "tests/support/plants.hpp"
#include "tests/support/systems.hpp"

using namespace wheelhop;
using namespace wheelhop::test;
using Catch::Contains;

namespace {

/// A plant's outputs as a rig reads them: each times its factor, on its offset, late by its delay, and noise.
struct Reading {
  PlantFit fit;
  std::vector<FitRecord> records;
  Reading(const Vector& factors, double noise, const Vector& offsets = Vector::Zero(3), double skew = 0) {
    Random random = numbers(861);
    fit.plant = plant_from(quarter_car_text);
    const Vector level = (Vector(3) << 0.01, 2, 9).finished();
    // Sums of sines, which can be read at any instant.
    Matrix made(3, 4000), late(3, 4000);
    for (Index j = 0; j < 3; ++j) {
      const Vector phase = 6.3 * random.normal(40, 1), turn = 0.3 * random.normal(40, 1).cwiseAbs();
      const auto at = [&](double k) { return level(j) * ((turn * k + phase).array().sin().sum()) / std::sqrt(20.0); };
      for (Index k = 0; k < made.cols(); ++k) {
        made(j, k) = at(static_cast<double>(k));
        late(j, k) = at((1 + skew) * static_cast<double>(k));
      }
    }
    Matrix read = factors.asDiagonal() * (late + noise * (level.asDiagonal() * random.normal(3, made.cols())));
    read.colwise() += offsets;
    records.push_back({random.normal(1, 20000), read, 5, 100, Vector::Ones(3), {}});
    fit.error.push_back(made - read);
  }
  std::vector<InstrumentFault> faults() const { return gross_faults(fit, records); }
};

}  // namespace

TEST_CASE("a channel in another unit or of the wrong sign is told with its factor, gain errors and strangers are not") {
  for (const double factor : {1e-3, 0.102, 9.81, 1e12, -1.0, -0.102}) {
    CAPTURE(factor);
    const std::vector<InstrumentFault> faults = Reading((Vector(3) << 1.2, factor, 0.9).finished(), 0.3).faults();
    REQUIRE(faults.size() == 1);
    CHECK(faults[0].effect == "gain_error");
    CHECK(faults[0].location == "sensor:body_acc"_at);
    CHECK(faults[0].value == Approx(factor).epsilon(0.1));
    CHECK_THAT(fault_message(faults), Contains("body_acc reads") && Contains("check unit and sign"));
  }
  CHECK(Reading((Vector(3) << 0.6, 1.0, 1.9).finished(), 0.3).faults().empty());
  CHECK(Reading((Vector(3) << 1.0, 0.0, 1.0).finished(), 0.3).faults().empty());
  CHECK(fault_message({}).empty());
}

TEST_CASE("where all channels are off alike the fault is the drive's, and two of three are two sensors") {
  for (const double factor : {-1.0, 1000.0}) {
    const std::vector<InstrumentFault> faults = Reading(Vector::Constant(3, factor), 0.1).faults();
    REQUIRE(faults.size() == 1);
    CHECK(faults[0].location == "actuator"_at);
    CHECK(faults[0].value == Approx(factor).epsilon(0.05));
    CHECK_THAT(fault_message(faults), Contains("every channel reads"));
  }
  const std::vector<InstrumentFault> two = Reading((Vector(3) << 1.0, 0.102, 0.102).finished(), 0.1).faults();
  REQUIRE(two.size() == 2);
  CHECK(two[0].location == "sensor:body_acc"_at);
  CHECK(two[1].location == "sensor:wheel_acc"_at);
  CHECK(Reading((Vector(3) << 1000.0, -1.0, 0.1).finished(), 0.1).faults().size() == 3);
}

TEST_CASE("accelerometers alone that are off by the factor of g are in another unit, and not the drive") {
  for (const double factor : {1 / 9.80665, 9.80665}) {
    Reading reading(Vector::Constant(3, factor), 0.1);
    for (Sensor& sensor : reading.fit.plant.sensors) sensor.kind = SensorKind::acceleration;
    CHECK(reading.faults().size() == 3);
  }
}

TEST_CASE("gravity in an accelerometer is an offset of its size, and an offset of a displacement is no gross fault") {
  for (const double offset : {9.81, -9.81}) {
    const std::vector<InstrumentFault> faults =
        Reading(Vector::Ones(3), 0.01, (Vector(3) << 0.1, offset, 0.0).finished()).faults();
    REQUIRE(faults.size() == 1);
    CHECK(faults[0].effect == "bias");
    CHECK(faults[0].location == "sensor:body_acc"_at);
    CHECK(faults[0].value == Approx(offset).epsilon(0.01));
  }
  // In g, and with gravity in it: the offset is in the unit of the record.
  const std::vector<InstrumentFault> both =
      Reading((Vector(3) << 1, 0.102, 1).finished(), 0.01, (Vector(3) << 0, 1, 0).finished()).faults();
  REQUIRE(both.size() == 2);
  CHECK(both[1].effect == "bias");
  CHECK(both[1].value == Approx(1).epsilon(0.05));
  CHECK(Reading(Vector::Ones(3), 0.01, (Vector(3) << 0, 0.1, 0.1).finished()).faults().empty());
}

TEST_CASE("a clock that runs at another rate is told with its sign, from a few samples over the record on") {
  for (const double skew : {0.005, -0.005, 0.0015, -0.02}) {
    CAPTURE(skew);
    const std::vector<InstrumentFault> faults =
        Reading((Vector(3) << 1, 1.3, 0.8).finished(), 0.1, Vector::Zero(3), skew).faults();
    REQUIRE(faults.size() == 1);
    CHECK(faults[0].effect == "clock_skew");
    CHECK(faults[0].value == Approx(skew).epsilon(0.1));
    CHECK_THAT(fault_message(faults), Contains("ppm"));
  }
  CHECK(Reading(Vector::Ones(3), 0.1, Vector::Zero(3), 1e-4).faults().empty());
  CHECK(Reading(Vector::Ones(3), 0.1).faults().empty());
  Reading decay(Vector::Ones(3), 0.1, Vector::Zero(3), 0.005);
  REQUIRE(decay.faults().size() == 1);
  decay.records[0].drive.setZero();  // without a drive there is no other clock
  CHECK(decay.faults().empty());
}

TEST_CASE("of several drives the one of another unit or sign is told, and gain errors of drives are not") {
  Json file = parse_json(quarter_car_text, "plant");
  file["inputs"].push_back(
      {{"name", "push"}, {"kind", "force"}, {"unit", "N"}, {"between", {"wheel", "body"}}, {"hold_hz", 1000}});
  const Plant plant = plant_from(file.dump());
  Random random = numbers(862);
  const Index samples = 1500, ratio = 5;
  Matrix drive(2, samples * ratio);
  for (Index k = 0; k < samples; ++k) {
    const double before = k > 0 ? drive(0, k * ratio - 1) : 0, push = k > 0 ? drive(1, k * ratio - 1) : 0;
    drive.row(0).segment(k * ratio, ratio).setConstant(0.9 * before + 0.002 * random.normal());
    drive.row(1).segment(k * ratio, ratio).setConstant(0.9 * push + 60 * random.normal());
  }
  const auto faults_of = [&](double road, double push) {
    const Matrix felt = Vector((Vector(2) << road, push).finished()).asDiagonal() * drive;
    PlantFit fit;
    fit.plant = plant;
    std::vector<FitRecord> records = {{drive, Matrix::Zero(3, samples), ratio, 50, Vector::Ones(3), {}}};
    const Matrix made = simulate_measured(plant, drive, run_options(plant, records[0])).outputs;
    records[0].y = simulate_measured(plant, felt, run_options(plant, records[0])).outputs;
    for (Index j = 0; j < 3; ++j)
      records[0].y.row(j) += 0.02 * records[0].y.row(j).norm() / std::sqrt(1500.0) * random.normal(1, samples);
    fit.error.push_back(made - records[0].y);
    return gross_faults(fit, records);
  };
  for (const double factor : {-0.6, -1.0, 0.4}) {
    CAPTURE(factor);
    const std::vector<InstrumentFault> push = faults_of(1, factor), road = faults_of(factor, 1);
    REQUIRE(push.size() == 1);
    CHECK(push[0].location == "actuator:push"_at);
    CHECK(push[0].value == Approx(factor).margin(0.1 * std::abs(factor)));
    CHECK_THAT(fault_message(push), Contains("push acts"));
    REQUIRE(road.size() == 1);
    CHECK(road[0].location == "actuator:road"_at);
    CHECK(road[0].value == Approx(factor).margin(0.15 * std::abs(factor)));
  }
  CHECK(faults_of(0.8, 1.3).empty());
  CHECK(faults_of(1, 1).empty());
}

TEST_CASE("two exchanged channels of one unit are told, and no others, whatever else is wrong with the plant") {
  const std::pair<std::string, std::string> none;
  Random random = numbers(862);
  for (int draw = 0; draw < 20; ++draw) {
    // Gains, offsets, noise, and a delay that grows: what a plant that is not exact leaves.
    const Vector factors = Vector::Ones(3) + 0.15 * random.normal(3, 1);
    Reading reading(factors, 0.1 * random.uniform(), random.normal(3, 1));
    CAPTURE(draw);
    CHECK(exchanged_channels(reading.fit, reading.records) == none);
    Reading swapped = reading;
    Matrix& y = swapped.records[0].y;
    Matrix& error = swapped.fit.error[0];
    const Matrix plant = y + error;
    // The two accelerometers, as often of one level as not.
    y.row(1).swap(y.row(2));
    error = plant - y;
    const auto names = exchanged_channels(swapped.fit, swapped.records);
    CHECK(names == std::pair<std::string, std::string>{"body_acc", "wheel_acc"});
    Reading units = reading;  // a travel and an acceleration are two columns of other units
    units.records[0].y.row(0).swap(units.records[0].y.row(1));
    units.fit.error[0] = plant - units.records[0].y;
    CHECK(exchanged_channels(units.fit, units.records) == none);
  }
}
