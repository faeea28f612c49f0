// Closure and the odds of rivals.
#include <catch2/catch.hpp>

#include "core/gap/evidence/closure.hpp"
#include "tests/support/systems.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

TEST_CASE("block misfits average to the misfit of the whole, however many samples stand over") {
  Random random = numbers(601);
  const Matrix r = random.normal(3, 1000);
  const Vector even = block_misfits(r, 100);
  REQUIRE(even.size() == 10);
  CHECK(even.mean() == Approx(r.squaredNorm() / 3000).epsilon(1e-12));
  Matrix loud_end = r;  // the last sample is no block
  loud_end.rightCols(1) *= 100;
  for (const Index samples : {901, 949, 951, 999}) {
    CAPTURE(samples);
    const Vector odd = block_misfits(loud_end.rightCols(samples), 100);
    CHECK(odd.size() == (samples < 950 ? 9 : 10));
    CHECK(odd.mean() ==
          Approx(loud_end.rightCols(samples).squaredNorm() / static_cast<double>(3 * samples)).epsilon(0.02));
  }
  CHECK(block_misfits(r.leftCols(30), 100).size() == 1);
  CHECK(block_misfits(r.leftCols(0), 100).size() == 0);
}

TEST_CASE(
    "closure is 1 at the floor, 0 without change, negative where things get worse, its interval holds the value") {
  Random random = numbers(602);
  const Vector before = 5 + random.normal(30, 1).array().abs();
  const Vector floor = Vector::Ones(30);
  CHECK(closure(before, floor, {200}).value == Approx(1));
  CHECK(closure(before, before, {200}).value == Approx(0).margin(1e-12));
  CHECK(closure(before, 2 * before, {200}).value < 0);
  const Vector noisy = 1.5 + 0.4 * random.normal(30, 1).array();
  const Closure some = closure(before, noisy, {400});
  CHECK(some.low < some.value);
  CHECK(some.value < some.high);
  // A floor that is not known well widens the interval by its error over the gap.
  const Closure vague = closure(before, floor, {2000, 0.1}), sure = closure(before, floor, {2000});
  CHECK(sure.high - sure.low < 1e-12);
  CHECK(1 - vague.low == Approx(1.96 * 0.1 / (before.mean() - 1)).epsilon(0.15));
  CHECK(vague.high == 1);
  CHECK(std::isnan(closure(0.9 * floor, floor, {10}).value));  // nothing to close
}

TEST_CASE("nine of ten closure intervals hold the true share, few blocks and a vague floor included") {
  Random random = numbers(603);
  constexpr Index trials = 400, blocks = 20;
  for (const double left : {0.0, 0.02, 0.3}) {
    Index inside = 0;
    for (Index trial = 0; trial < trials; ++trial) {
      const double floor_error = 0.04, noise = 1 + floor_error * random.normal();
      const Vector own = noise * (1 + 0.05 * random.normal(blocks, 1).array());  // of the held-out record
      const Vector gap = 2 * (1 + 0.4 * random.normal(blocks, 1).array());
      const Closure told = closure(own + gap, own + left * gap, {500, floor_error});
      inside += told.low <= 1 - left && 1 - left <= told.high;
    }
    CAPTURE(left);
    CHECK(static_cast<double>(inside) / trials == Approx(0.9).margin(0.07));
  }
}
