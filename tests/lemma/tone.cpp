// A tone in what a plant leaves.
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "core/gap/evidence/tone.hpp"
#include "core/plant/dataset.hpp"
#include "tests/support/plants.hpp"
#include "tests/support/systems.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

namespace {

/// Errors over one record of a plant that a drive moves, 10 s at 100 Hz.
struct Left {
  std::vector<FitRecord> records{1};
  PlantFit fit;
  Left(const Matrix& drive, const Matrix& error) {
    fit.plant = plant_from(one_mass_text);
    records[0].ratio = 5;
    records[0].drive = drive;
    records[0].y = Matrix::Zero(error.rows(), error.cols());
    records[0].weight_std = Vector::Ones(error.rows());
    fit.error = {error};
  }
};

constexpr Index kSamples = 1000;

Matrix sine(double frequency_hz, Index samples, double rate_hz, double phase) {
  return (Eigen::RowVectorXd::LinSpaced(samples, 0, static_cast<double>(samples - 1) / rate_hz).array() * 2 *
              std::numbers::pi * frequency_hz +
          phase)
      .sin()
      .matrix();
}

}  // namespace

TEST_CASE("a tone that no drive has is told with its channel and frequency, the drive's own and noise are none") {
  Random random = numbers(6441);
  for (int trial = 0; trial < 20; ++trial) {
    const double frequency = 5 + 40 * random.uniform(), phase = 6 * random.uniform(), noise = 0.1 + random.uniform();
    const auto channel = static_cast<Index>(3 * random.uniform());
    CAPTURE(frequency, noise, channel);
    const Matrix broad = random.normal(1, 5 * kSamples);
    Matrix error = random.normal(3, kSamples);
    CHECK_FALSE(tone_of(Left(broad, error).fit, Left(broad, error).records).seen);
    error *= noise;
    error.row(channel) += 3 * sine(frequency, kSamples, 100, phase);
    const Left hum(broad, error);
    const Tone tone = tone_of(hum.fit, hum.records);
    REQUIRE(tone.seen);
    CHECK(tone.channel == hum.fit.plant.sensors[static_cast<std::size_t>(channel)].name);
    CHECK(tone.frequency_hz == Approx(frequency).margin(0.03));
    CHECK(tone.share == Approx(4.5 / (4.5 + noise * noise)).margin(0.05));
    const Left driven(sine(frequency, 5 * kSamples, 500, 0), error);
    CHECK_FALSE(tone_of(driven.fit, driven.records).seen);
  }
  // Where the plant rings by itself, or nothing drives it, a tone may be its own.
  const Matrix ringing = sine(3.2, kSamples, 100, 0).replicate(3, 1), still = Matrix::Zero(1, 5 * kSamples);
  const Left own(random.normal(1, 5 * kSamples), ringing), decay(still, sine(20, kSamples, 100, 0).replicate(3, 1));
  CHECK_FALSE(tone_of(own.fit, own.records).seen);
  CHECK_FALSE(tone_of(decay.fit, decay.records).seen);
  // A drift is none, however much of the error it makes.
  const Matrix slow = 5 * sine(0.1, kSamples, 100, 1).replicate(3, 1);
  const Left drift(random.normal(1, 5 * kSamples), slow + random.normal(3, kSamples));
  CHECK_FALSE(tone_of(drift.fit, drift.records).seen);
}

TEST_CASE("a multiple of the tone that drives is told as one, whatever else the drive has") {
  Random random = numbers(6442);
  for (int trial = 0; trial < 20; ++trial) {
    const double drive_hz = 2 + 3 * random.uniform(), phase = 6 * random.uniform(), offset = 4 * random.normal();
    const int times = 2 + static_cast<int>(3 * random.uniform());
    CAPTURE(drive_hz, times);
    const Matrix drive = (sine(drive_hz, 5 * kSamples, 500, phase).array() + offset).matrix();
    const auto error_at = [&](double frequency_hz) {
      return Matrix(2 * sine(frequency_hz, kSamples, 100, phase).replicate(3, 1) + random.normal(3, kSamples));
    };
    const Left multiple(drive, error_at(times * drive_hz)), between(drive, error_at((times + 0.5) * drive_hz));
    const Left broad(random.normal(1, 5 * kSamples), error_at(times * drive_hz + 4));
    CHECK(tone_of(multiple.fit, multiple.records).seen);
    CHECK(tone_of(multiple.fit, multiple.records).multiple == times);
    CHECK(tone_of(between.fit, between.records).multiple == 0);
    CHECK(tone_of(broad.fit, broad.records).multiple == 0);
  }
}
