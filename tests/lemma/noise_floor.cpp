// The noise floor from repeats, from the record set, and from the quiet end of the spectrum.
#include <catch2/catch.hpp>
#include <cmath>

#include "core/data/metrics.hpp"
#include "core/gap/evidence/noise_floor.hpp"
#include "core/plant/dataset.hpp"
#include "tests/support/plants.hpp"
#include "tests/support/systems.hpp"

using namespace wheelhop;
using namespace wheelhop::test;
using Catch::Contains;

namespace {

constexpr Index kSamples = 4000;

/// Two outputs in the lower tenth of the band, as a vehicle's are.
Signal response() {
  Signal signal;
  signal.sample_time_s = 0.005;
  signal.inputs = {{"road", "m"}};
  signal.outputs = {{"travel", "m"}, {"acc", "m/s^2"}};
  signal.u.resize(1, kSamples);
  signal.y.resize(2, kSamples);
  for (Index k = 0; k < kSamples; ++k) {
    const double t = static_cast<double>(k) * signal.sample_time_s;
    signal.u(0, k) = std::sin(7 * t);
    signal.y(0, k) = 0.02 * std::sin(7 * t) + 0.01 * std::cos(31 * t);
    signal.y(1, k) = 3 * std::sin(7 * t + 1) - std::sin(44 * t);
  }
  return signal;
}

/// `repeats` noisy records of one drive. @param colour coefficient of first-order noise
RecordSet noisy(Index repeats, const Vector& std, double colour = 0, std::uint64_t seed = 501) {
  RecordSet set;
  set.sampling_hz = 200;
  Random random = numbers(seed);
  for (Index r = 0; r < repeats; ++r) {
    Record record{"r" + std::to_string(r) + ".csv", "estimation", repeats > 1 ? "drive" : "", 0, response()};
    Matrix noise = random.normal(2, kSamples);
    for (Index k = 1; k < kSamples; ++k)
      noise.col(k) = colour * noise.col(k - 1) + std::sqrt(1 - colour * colour) * noise.col(k);
    record.signal.y += std.asDiagonal() * noise;
    set.records.push_back(std::move(record));
  }
  return set;
}

const Vector kStd = (Vector(2) << 3e-4, 0.05).finished();

}  // namespace

TEST_CASE("repeats give the noise of one record, whatever its colour and however many repeats there are") {
  for (const double colour : {0.0, 0.8})
    for (const Index repeats : {2, 5}) {
      CAPTURE(colour, repeats);
      const NoiseFloor floor = noise_floor(noisy(repeats, kStd, colour));
      CHECK(floor.source == FloorSource::repeats);
      CHECK(floor.degrees == (repeats - 1) * kSamples);
      for (Index i = 0; i < 2; ++i) CHECK(floor.std(i) == Approx(kStd(i)).epsilon(0.07));
    }
}

TEST_CASE("the error told of the noise power is the scatter of that power, coloured noise included") {
  constexpr std::uint64_t sets = 40;
  for (const double colour : {0.0, 0.95}) {
    CAPTURE(colour);
    double scatter = 0, told = 0;
    for (std::uint64_t seed = 0; seed < sets; ++seed) {
      const NoiseFloor floor = noise_floor(noisy(2, kStd, colour, 7000 + seed));
      const double power = floor.std.cwiseQuotient(kStd).squaredNorm() / 2;
      scatter += (power - 1) * (power - 1) / static_cast<double>(sets);
      told += floor.power_error * floor.power_error / static_cast<double>(sets);
    }
    CHECK(told == Approx(scatter).epsilon(0.5));
  }
}

TEST_CASE("the mean of R repeats keeps the response and carries the floor over sqrt(R)") {
  RecordSet set = noisy(4, kStd);
  Record validation{"val.csv", "validation", "", 0, response()};
  set.records.push_back(validation);
  const std::vector<Measured> merged = merge_repeats(set);
  REQUIRE(merged.size() == 2);
  CHECK(merged[0].name == "drive");
  CHECK(merged[0].repeats == 4);
  CHECK(merged[1].name == "val.csv");
  CHECK(merged[1].role == "validation");
  const Vector left = rms(merged[0].signal.y - response().y);
  for (Index i = 0; i < 2; ++i) CHECK(left(i) == Approx(kStd(i) / 2).epsilon(0.05));
}

TEST_CASE("samples that no score counts are no noise either") {
  for (const Index repeats : {1, 2}) {
    CAPTURE(repeats);
    RecordSet set = noisy(repeats, kStd);
    const NoiseFloor clean = noise_floor(set);
    Random random = numbers(503);
    for (Record& record : set.records) {
      record.signal.skip = kSamples / 4;
      record.signal.y.leftCols(kSamples / 4) += random.normal(2, kSamples / 4);
    }
    const NoiseFloor floor = noise_floor(set);
    CHECK(floor.degrees == 3 * clean.degrees / 4);
    for (Index i = 0; i < 2; ++i) CHECK(floor.std(i) == Approx(clean.std(i)).epsilon(0.1));
    CHECK(floor.power_error < 0.2);
    CHECK(floor.colour < 1.5);
  }
}

TEST_CASE("inputs that were measured with noise are averaged as the outputs are, an actuator at rest among them") {
  RecordSet set = noisy(4, kStd);
  Random random = numbers(504);
  for (Record& record : set.records) {
    record.signal.inputs.push_back({"idle", "m"});
    record.signal.u.conservativeResize(2, kSamples);
    record.signal.u.row(1).setZero();
    record.signal.u += 0.01 * random.normal(2, kSamples);
  }
  const Matrix mean = merge_repeats(set).front().signal.u;
  CHECK(rms(mean.row(0) - response().u)(0) == Approx(0.005).epsilon(0.1));
  CHECK(rms(mean.row(1))(0) == Approx(0.005).epsilon(0.1));
}

TEST_CASE("without repeats the floor is the record set's, and without that the level of the quiet end of the band") {
  RecordSet set = noisy(1, kStd);
  const NoiseFloor estimated = noise_floor(set);
  CHECK(estimated.source == FloorSource::estimated);
  for (Index i = 0; i < 2; ++i) CHECK(estimated.std(i) == Approx(kStd(i)).epsilon(0.1));
  set.noise_std = {{"travel", 1e-3}, {"acc", 0.2}};
  const NoiseFloor given = noise_floor(set);
  CHECK(given.source == FloorSource::noise_std);
  CHECK(given.std(0) == 1e-3);
  CHECK(given.std(1) == 0.2);
  set.noise_std.erase("acc");
  CHECK_THROWS_WITH(noise_floor(set), Contains("acc"));
}

TEST_CASE("the error told of an estimated floor is what estimates of short records scatter by, and a tenth at least") {
  for (const Index samples : {60, 250, 1000, 4000}) {
    double scatter = 0, told = 0;
    const int draws = 60;
    for (std::uint64_t draw = 0; draw < draws; ++draw) {
      RecordSet set = noisy(1, kStd, 0, 7100 + draw);
      Signal& signal = set.records[0].signal;
      signal.u = signal.u.leftCols(samples).eval();
      signal.y = signal.y.rightCols(samples).eval();
      const NoiseFloor floor = noise_floor(set);
      const double power = floor.std.cwiseQuotient(kStd).cwiseAbs2().mean();
      scatter += (power - 1) * (power - 1) / draws;
      told += floor.power_error * floor.power_error / draws;
    }
    CAPTURE(samples, std::sqrt(scatter), std::sqrt(told));
    CHECK(told >= 0.01);
    CHECK(told < 0.0101 + 4 * scatter);
    CHECK(scatter < 2 * told);
  }
}

TEST_CASE("repeats of different drives or lengths, and outputs without noise, are refused with their names") {
  RecordSet other = noisy(2, kStd);
  other.records[1].signal.u *= 1.6;
  CHECK_THROWS_WITH(merge_repeats(other), Contains("road") && Contains("r1.csv") && Contains("60.0 %"));
  CHECK_THROWS_AS(noise_floor(other), UserError);
  RecordSet shorter = noisy(2, kStd);
  shorter.records[1].signal.u.conservativeResize(1, kSamples - 1);
  shorter.records[1].signal.y.conservativeResize(2, kSamples - 1);
  CHECK_THROWS_WITH(noise_floor(shorter), Contains("4000") && Contains("3999"));
  CHECK_THROWS_WITH(noise_floor(noisy(2, Vector::Zero(2))), Contains("travel") && Contains("noise_std"));
}

TEST_CASE("white noise has the colour 1, first-order noise that of its density at rest") {
  CHECK(noise_floor(noisy(2, kStd)).colour < 1.4);
  // (1 + a) / (1 - a) at zero frequency, seen over a band of 1/24 of all.
  const double peak = noise_floor(noisy(2, kStd, 0.8)).colour;
  CHECK(peak > 4);
  CHECK(peak < 9);
}

TEST_CASE("readings of a converter show its step, others show none") {
  Random random = numbers(502);
  const Vector fine = random.normal(3000, 1);
  for (const double step : {0.05, 0.3}) {
    Vector rounded(fine.size());
    for (Index k = 0; k < fine.size(); ++k) rounded(k) = 0.013 + step * std::round(fine(k) / step);
    CHECK(lattice_step(rounded) == Approx(step).epsilon(1e-6));
  }
  CHECK(lattice_step(fine) == 0);
  CHECK(lattice_step(Vector::Constant(100, 3.0)) == 0);
  CHECK(lattice_step(Vector()) == 0);
}

TEST_CASE(
    "noise of a measured drive is in the floor of a prediction, and a drive that differed from run to run is not") {
  const Plant plant = plant_from(quarter_car_text);
  const double noise = 0.01, sampling_hz = 200;
  for (const bool measured_wrong : {true, false}) {
    Random random = numbers(88);
    RecordSet set;
    set.sampling_hz = sampling_hz;
    const Matrix drive = 0.004 * random.normal(1, 4000);
    Vector response = Vector::Zero(3);
    for (int r = 0; r < 2; ++r) {
      Record record{"r" + std::to_string(r), "estimation", "drive", 0, {}};
      record.signal.sample_time_s = 1 / sampling_hz;
      record.signal.inputs = plant.input_channels();
      record.signal.outputs = plant.output_channels();
      const Matrix differs = drive + noise * 0.004 * random.normal(1, 4000);
      record.signal.u = drive;
      const Matrix as_planned = simulate_record(plant, record.signal).signal.y;
      record.signal.u = differs;
      const Matrix as_measured = simulate_record(plant, record.signal).signal.y;
      response += (as_measured - as_planned).rowwise().squaredNorm() / 4000 / 2;
      record.signal.y = measured_wrong ? as_planned : as_measured;
      for (Index i = 0; i < 3; ++i)
        record.signal.y.row(i) += 1e-3 * as_planned.row(i).norm() / std::sqrt(4000.0) * random.normal(1, 4000);
      set.records.push_back(record);
    }
    const NoiseFloor outputs = noise_floor(set), prediction = noise_floor(prediction_errors(plant, set));
    for (Index i = 0; i < 3; ++i) {
      CAPTURE(measured_wrong, i);
      const double more = response(i) / std::pow(outputs.std(i), 2);
      if (measured_wrong)
        CHECK(prediction.std(i) == Approx(outputs.std(i) * std::sqrt(1 + more)).epsilon(0.05));
      else
        CHECK(prediction.std(i) < 0.5 * outputs.std(i));
    }
  }
}

TEST_CASE("where repeats have one and the same input the floor is that of the outputs, to the bit") {
  const Plant plant = plant_from(quarter_car_text);
  Random random = numbers(89);
  RecordSet set;
  set.sampling_hz = 200;
  const Matrix drive = 0.004 * random.normal(1, 500);
  for (int r = 0; r < 2; ++r) {
    Record record{"r" + std::to_string(r), "estimation", "drive", 0, {}};
    record.signal = {drive, random.normal(3, 500), 0.005, 0, plant.input_channels(), plant.output_channels()};
    set.records.push_back(record);
  }
  CHECK(noise_floor(prediction_errors(plant, set)).std == noise_floor(set).std);
}

TEST_CASE(
    "records whose measured drives differ a little are repeats in whatever role, and their scatter is the floor") {
  const Plant plant = plant_from(quarter_car_text);
  Plant heavy = plant;
  heavy.masses[0].mass_kg *= 1.4;
  Random random = numbers(90);
  for (const double apart : {0.0, 0.03, 0.08, 0.12, 0.3}) {
    CAPTURE(apart);
    RecordSet set;
    set.sampling_hz = 200;
    const Matrix drive = 0.004 * random.normal(1, 4000);
    Vector scatter;
    for (const char* role : {"estimation", "validation"}) {
      Record record{role, role, "", 0, {}};
      record.signal.sample_time_s = 1 / set.sampling_hz;
      record.signal.inputs = plant.input_channels();
      record.signal.outputs = plant.output_channels();
      record.signal.u = drive + (set.records.empty() ? 0 : apart) * 0.004 * random.normal(1, 4000);
      record.signal.y = simulate_record(plant, record.signal).signal.y;
      if (scatter.size() == 0) scatter = 0.05 * rms(record.signal.y);
      record.signal.y += scatter.asDiagonal() * random.normal(3, 4000);
      set.records.push_back(record);
    }
    if (apart > 0.2) {
      CHECK(repeats_of(set).empty());
      continue;
    }
    REQUIRE(repeats_of(set).size() == 1);
    CHECK(merge_repeats(set).size() == 2);  // fitted and held out all the same
    const NoiseFloor floor = noise_floor(prediction_errors(plant, set));
    const NoiseFloor of_wrong = noise_floor(prediction_errors(heavy, set));
    CHECK(floor.source == FloorSource::repeats);
    REQUIRE(floor.repeats.size() == 1);
    CHECK(floor.repeats.front() == std::vector<std::string>{"estimation", "validation"});
    for (Index i = 0; i < 3; ++i) {
      CHECK(floor.std(i) == Approx(scatter(i)).epsilon(0.1));
      CHECK(of_wrong.std(i) > 0.97 * floor.std(i));
    }
    // What is given is not undercut by records that only look like repeats, and by a copy or at rest there is nothing
    // to be told.
    for (const Channel& output : plant.output_channels()) set.noise_std[output.name] = 1e3;
    CHECK(noise_floor(set).std == Vector::Constant(3, 1e3));
    RecordSet copies = set, at_rest = set;
    copies.records[1].signal = copies.records[0].signal;
    CHECK(repeats_of(copies).empty());
    for (Record& record : at_rest.records) record.signal.u.setZero();
    CHECK(repeats_of(at_rest).empty());
  }
}
