// Single bad samples: found in what moves like a structure, and nothing else taken for one.
#include <catch2/catch.hpp>
#include <cmath>

#include "core/data/spikes.hpp"
#include "tests/support/systems.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

namespace {

/// Three channels of a structure at 20 to 400 times its fastest mode, with noise.
Matrix motion(Random& random, double noise) {
  Matrix y(3, 1500);
  const double fastest = 6.28 / (20 + 380 * random.uniform());
  for (Index j = 0; j < 3; ++j) {
    const Vector phase = 6.3 * random.normal(12, 1), turn = fastest * random.normal(12, 1).cwiseAbs().cwiseMin(1);
    const double level = std::pow(10, 2 * random.normal());
    for (Index k = 0; k < y.cols(); ++k)
      y(j, k) = level * ((turn * static_cast<double>(k) + phase).array().sin().sum() / 3 + noise * random.normal());
  }
  return y;
}

double rms(const Matrix& y, Index j) { return y.row(j).norm() / std::sqrt(static_cast<double>(y.cols())); }

}  // namespace

TEST_CASE("a bad sample is found where it is and bridged to what was there, whatever its channel, sign and height") {
  Random random = numbers(31);
  for (int trial = 0; trial < 200; ++trial) {
    CAPTURE(trial);
    const Matrix clean = motion(random, 0.002);
    Matrix y = clean;
    const Index j = random.integer(3), k = 10 + random.integer(1480);
    y(j, k) += (trial % 2 ? 1 : -1) * rms(clean, j) * std::pow(10, 3 * random.uniform());
    const std::vector<SpikeAt> spikes = find_spikes(y);
    REQUIRE(spikes.size() == 1);
    CHECK(spikes[0].channel == j);
    CHECK(spikes[0].sample == k);
    CHECK(std::abs(spikes[0].instead - clean(j, k)) < 0.02 * rms(clean, j));
  }
}

TEST_CASE(
    "noise, steps, impacts that all channels feel, pulses of two samples and coarse converters are no bad samples") {
  Random random = numbers(32);
  for (int trial = 0; trial < 60; ++trial) {
    CAPTURE(trial);
    const Matrix clean = motion(random, trial % 3 ? 0.01 : 1.0);
    CHECK(find_spikes(clean).empty());
    Matrix step = clean;
    step.row(1).tail(700).array() += 50 * rms(clean, 1);
    CHECK(find_spikes(step).empty());
    Matrix impact = clean;
    for (Index j = 0; j < 3; ++j) impact(j, 600) += 30 * rms(clean, j);
    CHECK(find_spikes(impact).empty());
    Matrix coarse = clean;
    coarse.row(0) = rms(clean, 0) * (clean.row(0) / rms(clean, 0)).array().round();
    CHECK(find_spikes(coarse).empty());
    CHECK(find_spikes(random.normal(3, 1500)).empty());
  }
  CHECK(find_spikes(Matrix::Zero(2, 100)).empty());
  CHECK(find_spikes(Matrix::Zero(2, 1)).empty());
}

TEST_CASE("a set lists what it bridged with file, channel, time and both values, and leaves its inputs alone") {
  Random random = numbers(33);
  RecordSet set;
  set.sampling_hz = 200;
  Record record;
  record.file = "run.csv";
  record.first = 100;
  record.signal.outputs = {{"a", "m"}, {"b", "m"}, {"c", "m"}};
  record.signal.y = motion(random, 0.001);
  record.signal.u = Matrix::Zero(1, 1500);
  record.signal.u(0, 700) = 1;
  const double before = record.signal.y(1, 300);
  record.signal.y(1, 300) += 1000 * rms(record.signal.y, 1);
  const double bad = record.signal.y(1, 300);
  set.records = {record};
  bridge_spikes(set);
  REQUIRE(set.spikes.size() == 1);
  CHECK(set.spikes[0].file == "run.csv");
  CHECK(set.spikes[0].channel == "b");
  CHECK(set.spikes[0].time_s == Approx(2.0));
  CHECK(set.spikes[0].value == bad);
  CHECK(set.records[0].signal.y(1, 300) == set.spikes[0].instead);
  CHECK(std::abs(set.spikes[0].instead - before) < 0.05 * rms(set.records[0].signal.y, 1));
  CHECK(set.records[0].signal.u == record.signal.u);
}
