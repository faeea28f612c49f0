// Channels that were read less often than their file has samples: seen as what they are, and nothing else taken for
// one.
#include "core/data/slow_channels.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "core/gap/evidence/noise_floor.hpp"
#include "core/greybox/plant_fit.hpp"
#include "core/plant/dataset.hpp"
#include "tests/support/plants.hpp"
#include "tests/support/systems.hpp"
#include "variants/solver/levenberg_marquardt.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

namespace {

/// Sines and noise, N samples.
Vector moving(Random& random, Index N, double noise) {
  Vector y = Vector::Zero(N);
  for (int sine = 0; sine < 6; ++sine) {
    const double turn = 0.3 * random.uniform(), phase = 6.3 * random.uniform();
    for (Index k = 0; k < N; ++k) y(k) += std::sin(turn * static_cast<double>(k) + phase);
  }
  return y + noise * random.normal(N, 1);
}

/// A row as a logger makes it of readings at given instants, the first of which is 0.
Vector as_made(const Vector& y, const std::vector<Index>& read, bool lines) {
  Vector out(y.size());
  std::size_t piece = 0;
  for (Index k = 0; k < y.size(); ++k) {
    while (piece + 1 < read.size() && read[piece + 1] <= k) ++piece;
    const Index before = read[piece], after = piece + 1 < read.size() ? read[piece + 1] : before;
    const double share =
        lines && after > before ? static_cast<double>(k - before) / static_cast<double>(after - before) : 0;
    out(k) = (1 - share) * y(before) + share * y(after);
  }
  return out;
}

/// Every so many samples, in the mean; jitter: one earlier or later now and then.
std::vector<Index> instants(Random& random, Index N, double every, bool jitter) {
  std::vector<Index> list = {0};
  for (double at = every; at < static_cast<double>(N - 1); at += every) {
    const auto k = static_cast<Index>(at) + (jitter && random.uniform() < 0.1 ? random.integer(3) - 1 : 0);
    if (k > list.back() && k < N) list.push_back(k);
  }
  return list;
}

}  // namespace

TEST_CASE("repeated readings and lines between readings are seen, at whole and other rates, and nothing else is") {
  Random random = numbers(41);
  const Index N = 3000;
  for (int trial = 0; trial < 120; ++trial) {
    const bool lines = trial % 3 == 0, jitter = trial % 4 == 0;
    double every = lines ? 2 + static_cast<double>(random.integer(9)) : 1.6 + 10 * random.uniform();
    if (jitter) every = std::ceil(every) + 2;  // by one of three samples or more
    const double noise = trial % 2 == 0 ? 0.05 : 1e-4;
    CAPTURE(trial, every, lines, jitter);
    Matrix y(2, N);
    const Vector whole = moving(random, N, noise);
    y.row(0) = moving(random, N, noise).transpose();
    const std::vector<Index> read = instants(random, N, every, jitter && !lines);
    y.row(1) = as_made(whole, read, lines).transpose();
    const std::vector<SlowChannel> slow = slow_channels(y);
    REQUIRE(slow.size() == 2);
    CHECK(slow[0].before.empty());
    REQUIRE_FALSE(slow[1].before.empty());
    CHECK(slow[1].lines == lines);
    CHECK(slow[1].samples == Approx(every).epsilon(0.05));
    // What was read makes the channel again, of the channel itself and of what it was made of.
    Matrix again = y;
    again.row(1) = whole.transpose();
    as_logged(slow, again);
    const double last = static_cast<double>(N) - 2 * every;  // behind the last reading nothing tells it
    CHECK((again - y).leftCols(static_cast<Index>(last)).cwiseAbs().maxCoeff() < 2e-2 * (lines ? 1 : 1e-12));
    CHECK(again.row(0) == y.row(0));
    const double exact = lines ? 5e-3 : 1e-9;  // a bend that is hardly one is not seen
    Matrix itself = y;
    as_logged(slow, itself);
    CHECK((itself - y).cwiseAbs().maxCoeff() < exact);
    // Any part of it too, but for what was read before it begins.
    const Index begin = 100 + random.integer(500), count = 1000;
    const std::vector<SlowChannel> part = part_of(slow, begin, count);
    Matrix middle = y.middleCols(begin, count);
    as_logged(part, middle);
    const auto known = static_cast<Index>(std::ceil(2 * every));
    CHECK((middle - y.middleCols(begin, count)).middleCols(known, count - 2 * known).cwiseAbs().maxCoeff() < exact);
  }
  for (int trial = 0; trial < 60; ++trial) {
    CAPTURE(trial);
    Matrix y(4, N);
    const Vector clean = moving(random, N, trial % 2 == 0 ? 0.01 : 0);
    y.row(0) = clean.transpose();
    y.row(1) = (clean * (1 + 20 * random.uniform())).array().round().matrix().transpose();  // a coarse converter
    for (Index k = 0; k < N; ++k) {
      y(2, k) = std::floor(0.013 * static_cast<double>(k % 700));  // a ramp through one
      y(3, k) = k < N / 2 ? 0 : clean(k);                          // at rest, then moving
    }
    CHECK(slow_channels(y).empty());
  }
  CHECK(slow_channels(Matrix::Zero(2, 100)).empty());
  CHECK(slow_channels(Matrix(1, 0)).empty());
}

TEST_CASE("the mean response of a slow channel is that of its readings to a sine") {
  Random random = numbers(42);
  const Index N = 6000;
  for (const bool lines : {false, true})
    for (const Index every : {2, 4, 7}) {
      const std::vector<Index> read = instants(random, N, static_cast<double>(every), false);
      const std::vector<SlowChannel> slow = slow_channels(as_made(moving(random, N, 0.01), read, lines).transpose());
      REQUIRE(slow.size() == 1);
      for (const double cycles : {0.01, 0.037, 0.06}) {
        Matrix cosine(1, N), sine(1, N);
        for (Index k = 0; k < N; ++k) {
          cosine(0, k) = std::cos(2 * std::numbers::pi * cycles * static_cast<double>(k));
          sine(0, k) = std::sin(2 * std::numbers::pi * cycles * static_cast<double>(k));
        }
        Matrix made = cosine;
        as_logged(slow, made);
        const std::complex<double> seen(made.row(0).dot(cosine.row(0)), -made.row(0).dot(sine.row(0)));
        const std::complex<double> expected = response_of(slow[0], cycles);
        CAPTURE(lines, every, cycles);
        CHECK(std::abs(2.0 / static_cast<double>(N) * seen - expected) < 0.02);
      }
    }
}

TEST_CASE("of a slow channel a fit compares what was read, and the floor is that of the readings") {
  Plant plant = plant_from(quarter_car_text);
  plant.inputs[0].interpolation = "zoh";
  Random random = numbers(43);
  Matrix drive(1, 4000 * 5);
  double state = 0;
  for (Index k = 0; k < drive.cols(); ++k)  // held between the samples of the record
    drive(0, k) = k % 5 > 0 ? drive(0, k - 1) : 0.004 * (state = 0.9 * state + 0.4 * random.normal());
  RecordSet set;
  set.sampling_hz = 200;
  Record record{"a.csv", "estimation", "", 0, generate_record(plant, drive, 200).signal};
  const Vector noise = 0.01 * record.signal.y.rowwise().norm() / std::sqrt(4000.0);
  record.signal.y += noise.asDiagonal() * random.normal(3, 4000);
  for (const Index row : {0, 1})
    record.signal.y.row(row) =
        as_made(record.signal.y.row(row).transpose(), instants(random, 4000, row == 0 ? 4 : 2.5, false), false)
            .transpose();
  set.records = {record};
  const double coarse = noise_floor(set).std(0) / noise(0);
  find_slow_channels(set);
  REQUIRE(set.records[0].signal.slow.size() == 3);
  CHECK(slow_outputs(set).size() == 2);
  CHECK(slow_outputs(set)[0].rate_hz == Approx(50).epsilon(0.01));
  const NoiseFloor floor = noise_floor(set);
  CHECK(floor.std(0) / noise(0) < 0.7 * coarse);  // which counts the steps of the staircase
  CHECK(floor.colour == Approx(4).epsilon(0.01));
  const FitRecord made = fit_record(plant, set.records[0].signal, noise);
  const PlantFit fit = fit_plant(plant, tolerance_parameters(plant), {made}, *make_levenberg_marquardt({}), {20});
  CHECK(fit.misfit == Approx(1).epsilon(0.05));
  for (Index i = 0; i < fit.theta.size(); ++i)
    CHECK(std::abs(fit.theta(i)) < 4 * std::sqrt(4 * fit.covariance(i, i)) + 0.02);
  // The derivatives are those of what is compared.
  Vector above, below;
  for (Index i = 0; i < fit.theta.size(); ++i) {
    const FitParameter parameter = tolerance_parameters(plant)[static_cast<std::size_t>(i)];
    Plant moved = fit.plant;
    const double here = get_parameter(moved, parameter.name), step = 1e-3 * parameter.scale;
    set_parameter(moved, parameter.name, here + step);
    REQUIRE(plant_residual(moved, {made}, fit.initial_states, above));
    set_parameter(moved, parameter.name, here - step);
    REQUIRE(plant_residual(moved, {made}, fit.initial_states, below));
    const Vector difference = (above - below) / 2e-3;
    CHECK((fit.jacobian.col(i) - difference).norm() < 1e-2 * difference.norm());
  }
}
