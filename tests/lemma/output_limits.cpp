// Outputs that were cut off: their limits are found where there are some, and nowhere else.
#include "core/data/output_limits.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "tests/support/systems.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// A slow signal of twelve tones about a mean, 30 to 100 samples a period of the fastest, with noise.
Matrix slow_signal(Random& random, double noise) {
  Matrix y(1, 2000);
  const double fastest = 6.28 / (30 + 70 * random.uniform()), mean = 3 * random.normal();
  const Vector phase = 6.3 * random.normal(12, 1), turn = fastest * random.normal(12, 1).cwiseAbs().cwiseMin(1);
  for (Index k = 0; k < y.cols(); ++k)
    y(0, k) = mean + (turn * static_cast<double>(k) + phase).array().sin().sum() / 3 + noise * random.normal();
  return y;
}

Matrix rounded(const Matrix& y, double step) { return step * (y / step).array().round(); }

double level(const Matrix& y, double share) {
  std::vector<double> values(y.data(), y.data() + y.size());
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

}  // namespace

TEST_CASE("limits at which an output was cut off are found exactly, at either end and over several records") {
  Random random = numbers(4101);
  for (int trial = 0; trial < 60; ++trial) {
    CAPTURE(trial);
    const double noise = trial % 2 == 0 ? 0 : 0.01;
    std::vector<Matrix> whole{slow_signal(random, noise), slow_signal(random, noise)};
    const double high = level(whole[0], 0.93), low = trial % 3 == 0 ? level(whole[0], 0.06) : -kInfinity;
    const OutputLimits sensor{Vector::Constant(1, low), Vector::Constant(1, high)};
    std::vector<ConstMatrixRef> outputs;
    for (Matrix& y : whole) {
      if (trial % 4 == 1) y = rounded(y, 1e-4);
      cut_off(sensor, y);
      outputs.emplace_back(y);
    }
    const OutputLimits found = find_output_limits(outputs);
    REQUIRE(found.any());
    CHECK(found.high(0) == high);
    CHECK(found.low(0) == low);
  }
}

TEST_CASE("rounded peaks, rest, a single flat top and constants are not cut off") {
  Random random = numbers(4102);
  for (int trial = 0; trial < 60; ++trial) {
    CAPTURE(trial);
    const Matrix y = slow_signal(random, trial % 2 == 0 ? 0 : 0.01);
    CHECK_FALSE(find_output_limits({y}).any());
    CHECK_FALSE(find_output_limits({rounded(y, std::pow(10, -3 + 2.5 * random.uniform()))}).any());
    // Pulses that die away into rest at the lowest value that a file with four decimals shows.
    Matrix pulses = Matrix::Zero(1, 2000);
    for (Index k = 0; k < 2000; ++k) pulses(0, k) = std::exp(-0.02 * static_cast<double>(k % 700));
    CHECK_FALSE(find_output_limits({rounded(pulses, 1e-4)}).any());
    Matrix once = y;
    once.middleCols(600, 40).setConstant(y.maxCoeff() + 1);
    CHECK_FALSE(find_output_limits({once}).any());
  }
  CHECK_FALSE(find_output_limits({Matrix::Constant(2, 100, 3.0)}).any());
  CHECK_FALSE(find_output_limits({Matrix(2, 0)}).any());
  CHECK_FALSE(find_output_limits({}).any());
}

TEST_CASE("an error counts where the sample is inside the limits, or the run is") {
  const OutputLimits limits{Vector::Constant(1, -kInfinity), Vector::Constant(1, 2.0)};
  Matrix y(1, 4), error(1, 4);
  y << 2, 2, 1, -5;
  error << 3, -0.5, 3, 1;
  excuse_beyond(limits, y, error);
  CHECK(error == (Matrix(1, 4) << 0, -0.5, 3, 1).finished());
  Matrix shown(1, 3);
  shown << -7, 1, 9;
  cut_off(limits, shown);
  CHECK(shown == (Matrix(1, 3) << -7, 1, 2).finished());
  cut_off({}, shown);
  CHECK(shown(2) == 2);
  const OutputLimits other = over(limits, Vector::Constant(1, 4.0));
  CHECK(other.high(0) == 0.5);
  CHECK(other.low(0) == -kInfinity);
}
