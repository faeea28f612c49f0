// What kind of gap: repeatable or not, steady or drifting, linear, odd or even.
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "core/gap/evidence/split.hpp"
#include "tests/support/plants.hpp"
#include "tests/support/systems.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

namespace {

constexpr double kStep = 0.005;
const Vector kFloor = (Vector(3) << 1e-4, 0.02, 0.3).finished();

/// The quarter car's three channels on a smooth random response; the error is to be filled in.
struct SplitCase {
  PlantFit fit;
  std::vector<FitRecord> records;

  explicit SplitCase(Index samples, double repeats = 1) {
    fit.plant = plant_from(quarter_car_text);
    Random random = numbers(821);
    Matrix y = random.normal(3, samples);
    for (Index k = 1; k < samples; ++k) y.col(k) = 0.8 * y.col(k - 1) + 0.6 * y.col(k);
    records.push_back(
        {Matrix::Zero(1, 5 * samples), 50 * kFloor.asDiagonal() * y, 5, 0, kFloor / std::sqrt(repeats), {}});
    fit.error.push_back(kFloor.asDiagonal() * random.normal(3, samples) / std::sqrt(repeats));
  }
};

/// Sum of cosines of equal size on the given lines of a period, random phases, repeated.
Vector multisine(const std::vector<Index>& lines, Index period, Index periods, Random& random) {
  Vector one = Vector::Zero(period);
  for (const Index line : lines) {
    const double phase = 2 * std::numbers::pi * random.uniform();
    for (Index k = 0; k < period; ++k)
      one(k) +=
          std::cos(2 * std::numbers::pi * static_cast<double>(line * k % period) / static_cast<double>(period) + phase);
  }
  one /= one.norm() / std::sqrt(static_cast<double>(period));
  return one.replicate(periods, 1);
}

/// Odd lines up to `highest`, one of every `group` of them left out; or all lines.
std::vector<Index> lines_of(Index highest, Index group) {
  std::vector<Index> lines;
  for (Index k = 1, n = 0; k <= highest; k += group > 0 ? 2 : 1, ++n)
    if (group == 0 || n % group != group / 2) lines.push_back(k);
  return lines;
}

/// A case driven by `u` whose error in two channels is error(u) in floors, over noise of a tenth of that.
template <class Error>
LineSplit split_of(const Vector& u, Error error) {
  SplitCase one(u.size());
  Random random = numbers(822);
  one.records[0].drive.resize(1, 5 * u.size());
  for (Index k = 0; k < one.records[0].drive.cols(); ++k) one.records[0].drive(0, k) = 0.003 * u(k / 5);
  one.fit.error[0] = 0.3 * kFloor.asDiagonal() * random.normal(3, u.size());
  for (Index k = 0; k < u.size(); ++k) {
    one.fit.error[0](0, k) += kFloor(0) * error(u(k));
    one.fit.error[0](2, k) -= 2 * kFloor(2) * error(u(k));
  }
  return line_split(one.fit, one.records);
}

}  // namespace

TEST_CASE(
    "of an error with three parts that repeat to one that does not, three quarters repeat, whatever the repeats") {
  for (const double repeats : {2.0, 8.0}) {
    SplitCase one(20000, repeats);
    Random random = numbers(823);
    one.fit.error[0] += std::sqrt(3.0) * kFloor.asDiagonal() * random.normal(3, 20000);
    NoiseFloor floor;
    floor.std = kFloor;
    floor.source = FloorSource::repeats;
    const Repeatability found = repeatability(one.fit, one.records, floor);
    CHECK(found.known);
    CHECK(found.share == Approx(0.75).epsilon(0.03));
    for (const double share : found.channel) CHECK(share == Approx(0.75).epsilon(0.05));
    floor.source = FloorSource::noise_std;
    CHECK_FALSE(repeatability(one.fit, one.records, floor).known);
  }
}

TEST_CASE("a steady error does not drift, a growing one does, and so does a gain that changes its sign on the way") {
  const Index samples = 8000;
  const auto drift_of = [&](auto change) {
    SplitCase one(samples);
    for (Index k = 0; k < samples; ++k) change(one, k, static_cast<double>(k) / static_cast<double>(samples));
    return drift(one.fit, one.records, 400);
  };
  const Drift steady =
      drift_of([](SplitCase& c, Index k, double) { c.fit.error[0](1, k) += 0.1 * c.records[0].y(1, k); });
  CHECK(steady.known);
  CHECK_FALSE(steady.significant);
  Random random = numbers(824);
  const Drift grows =
      drift_of([&](SplitCase& c, Index k, double t) { c.fit.error[0](2, k) += 4 * t * kFloor(2) * random.normal(); });
  CHECK(grows.significant);
  CHECK(grows.kind == "size");
  CHECK(grows.last > 2 * grows.first);
  const Drift gain =
      drift_of([](SplitCase& c, Index k, double t) { c.fit.error[0](1, k) += 0.1 * (t - 0.5) * c.records[0].y(1, k); });
  CHECK(gain.significant);
  CHECK(gain.kind == "gain");
  CHECK(gain.channel == "body_acc");
  CHECK(gain.last - gain.first == Approx(0.1 * 2 / 3).epsilon(0.15));
  const Drift offset = drift_of([](SplitCase& c, Index k, double t) { c.fit.error[0](0, k) += 3 * t * kFloor(0); });
  CHECK(offset.kind == "offset");
  CHECK(offset.channel == "travel");
  CHECK(offset.last > offset.first);
  CHECK_FALSE(drift_of([](SplitCase&, Index, double) {}).significant);
  SplitCase shorter(3000);
  CHECK_FALSE(drift(shorter.fit, shorter.records, 400).known);
}

TEST_CASE("an odd random-phase multisine tells a linear, a quadratic and a cubic error apart") {
  Random random = numbers(825);
  for (const Index periods : {1, 2, 5}) {
    CAPTURE(periods);
    const Vector u = multisine(lines_of(99, 4), 1000, periods, random);
    const LineSplit linear = split_of(u, [](double x) { return 3 * x; });
    REQUIRE(linear.known);
    CHECK(linear.odd_apart);
    CHECK(linear.linear > 0.97);
    CHECK(linear.period_s == Approx(5));
    CHECK(linear.periods == (periods > 2 ? periods - 1 : periods));
    const LineSplit even = split_of(u, [](double x) { return 2 * (x * x - 1); });
    CHECK(even.even > 0.95);
    // A cube less its average gain on a Gaussian drive.
    const LineSplit odd = split_of(u, [](double x) { return x * x * x - 3 * x; });
    CHECK(odd.odd > 0.8);
    CHECK(odd.even < 0.05);
    CHECK(odd.linear + odd.odd + odd.even == Approx(1));
    const LineSplit both = split_of(u, [](double x) { return 3 * x + 2 * (x * x - 1); });
    CHECK(both.linear == Approx(9 / 17.0).epsilon(0.15));
    CHECK(both.even == Approx(8 / 17.0).epsilon(0.15));
  }
}

TEST_CASE("where the drive does not tell odd from even, the split says so and gives no shares") {
  Random random = numbers(826);
  const auto error = [](double x) { return 2 * x * x; };
  const LineSplit noise = split_of(random.normal(4000, 1), error);
  CHECK_FALSE(noise.known);
  CHECK(noise.why_not.find("not periodic") != std::string::npos);
  // Noise whose spectrum falls steeply has hardly anything in many lines, and is no multisine for it.
  Vector low = random.normal(4000, 1);
  for (int pole = 0; pole < 4; ++pole)
    for (Index k = 1; k < low.size(); ++k) low(k) = low(k - 1) + 0.27 * (low(k) - low(k - 1));
  CHECK_FALSE(split_of(low / low.norm() * std::sqrt(4000.0), error).known);
  CHECK_FALSE(split_of(low.head(1000).replicate(4, 1) / low.norm() * std::sqrt(4000.0), error).known);
  const LineSplit full = split_of(multisine(lines_of(99, 0), 1000, 4, random), error);
  CHECK_FALSE(full.known);
  CHECK(full.why_not.find("every line") != std::string::npos);
  // All odd lines: the even share is there, odd and linear cannot be parted.
  const LineSplit odd_only = split_of(multisine(lines_of(99, 1000), 1000, 4, random), error);
  CHECK(odd_only.known);
  CHECK_FALSE(odd_only.odd_apart);
  CHECK(odd_only.even > 0.95);
}

TEST_CASE("the period of a drive is its shortest, and noise has none") {
  Random random = numbers(827);
  CHECK(find_period(multisine(lines_of(40, 0), 640, 5, random).transpose()) == 640);
  CHECK(find_period(multisine({5, 10, 20}, 1000, 3, random).transpose()) == 200);
  CHECK(find_period(random.normal(1, 5000)) == 0);
  Vector noisy = multisine(lines_of(80, 4), 900, 3, random);
  noisy += 0.02 * random.normal(noisy.size(), 1);
  CHECK(find_period(noisy.transpose()) == 900);
  CHECK(find_period(multisine(lines_of(40, 0), 640, 1, random).transpose()) == 0);
}
