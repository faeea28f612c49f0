#include "core/data/resample.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "core/base/random.hpp"

using namespace wheelhop;

namespace {

const Interpolation kKinds[] = {Interpolation::band_limited, Interpolation::zoh, Interpolation::linear};

/// Two channels: sine and cosine of `hz` sampled at `rate`.
Matrix tone(double hz, double rate, Index samples) {
  Matrix result(2, samples);
  for (Index k = 0; k < samples; ++k) {
    const double angle = 2 * std::numbers::pi * hz * static_cast<double>(k) / rate;
    result.col(k) << std::sin(angle + 0.3), std::cos(angle + 0.3);
  }
  return result;
}

/// Largest error over the amplitude when a tone goes from one rate to the other, `margin` samples away from the ends.
double tone_error(double hz, double from, double to, Index samples, Index margin, Interpolation kind) {
  const Matrix got = interpolate(tone(hz, from, samples), from, to, kind);
  const Matrix want = tone(hz, to, got.cols());
  const auto cut = static_cast<Index>(std::ceil(static_cast<double>(margin) * to / from));
  return (got - want).middleCols(cut, got.cols() - 2 * cut).cwiseAbs().maxCoeff();
}

}  // namespace

TEST_CASE("decimation picks every n-th sample, the first included") {
  const Matrix x = Random(1, Stream::road).normal(2, 11);
  const Matrix d = decimate(x, 5);
  REQUIRE(d.cols() == 3);
  CHECK(d.col(0) == x.col(0));
  CHECK(d.col(2) == x.col(10));
  CHECK(decimate(x, 1) == x);
  CHECK(decimate(x, 100).cols() == 1);
  CHECK(decimate(Matrix(2, 0), 3).cols() == 0);
  CHECK_THROWS_AS(decimate(x, 0), std::invalid_argument);
}

TEST_CASE("every kind keeps the given samples bit for bit, so decimation undoes interpolation") {
  for (Index n : {1, 2, 3, 10, 31, 32, 33, 200}) {
    const Matrix x = Random(2, Stream::road).normal(3, n);
    for (Interpolation kind : kKinds)
      for (Index factor : {1, 2, 5, 7}) {
        const Matrix up = interpolate(x, factor, kind);
        REQUIRE(up.cols() == n * factor);
        CHECK(all_finite(up));
        CHECK(decimate(up, factor) == x);
      }
  }
}

TEST_CASE("a 10 Hz drive at 200 Hz is rebuilt at 1000 Hz to one in a million, where a straight line costs a percent") {
  CHECK(tone_error(10, 200, 1000, 2000, 32, Interpolation::band_limited) < 1e-7);
  CHECK(tone_error(10, 200, 1000, 2000, 32, Interpolation::linear) > 0.01);
  CHECK(tone_error(10, 200, 1000, 2000, 32, Interpolation::zoh) > 0.2);
}

TEST_CASE("the band in which interpolation is accurate reaches 85 Hz at 200 Hz") {
  for (double hz : {0.1, 1.0, 25.0, 50.0, 70.0, 80.0, 85.0}) {
    CAPTURE(hz);
    CHECK(tone_error(hz, 200, 1000, 2000, 32, Interpolation::band_limited) < 2e-7);
  }
  CHECK(tone_error(90, 200, 1000, 2000, 32, Interpolation::band_limited) < 1e-2);
}

TEST_CASE("rates in any ratio give the same signal: rational, irrational, downward and equal") {
  CHECK(tone_error(10, 500, 1000, 2000, 32, Interpolation::band_limited) < 2e-7);
  CHECK(tone_error(10, 300, 1000, 2000, 32, Interpolation::band_limited) < 2e-7);
  CHECK(tone_error(10, 610.3515625, 1000, 3000, 32, Interpolation::band_limited) < 2e-7);
  CHECK(tone_error(10, 200, 1000 * std::numbers::sqrt2, 1000, 32, Interpolation::band_limited) < 2e-7);
  CHECK(tone_error(10, 1000, 300, 3000, 32, Interpolation::band_limited) < 2e-7);
  const Matrix x = Random(3, Stream::road).normal(2, 500);
  for (Interpolation kind : kKinds) {
    CHECK(interpolate(x, 610.3515625, 610.3515625, kind) == x);
    CHECK(interpolate(x, 200.0, 1000.0, kind) == interpolate(x, Index{5}, kind));
    CHECK(interpolate(x, 1.0 / 3, 1.0, kind) == interpolate(x, Index{3}, kind));
    // 500 samples at 200 Hz last 2.5 s: instants 0 ... 749 of 300 Hz lie within.
    CHECK(interpolate(x, 200.0, 300.0, kind).cols() == 750);
    CHECK(interpolate(x, 200.0, 100.0, kind) == decimate(x, 2));
  }
}

TEST_CASE("constants are kept everywhere and straight lines too, up to the ends") {
  Matrix x(2, 300);
  for (Index k = 0; k < 300; ++k) x.col(k) << 7.5, 3 - 0.25 * static_cast<double>(k);
  const Matrix up = interpolate(x, 5, Interpolation::band_limited);
  for (Index k = 0; k < up.cols(); ++k) {
    CHECK(up(0, k) == Approx(7.5).epsilon(1e-13));
    CHECK(up(1, k) == Approx(3 - 0.05 * static_cast<double>(k)).margin(1e-6));
  }
  const Matrix straight = interpolate(x, 5, Interpolation::linear);
  CHECK(straight(1, 1) == Approx(2.95));
  CHECK(straight(1, 1496) == x(1, 299));
  CHECK(interpolate(x, 5, Interpolation::zoh).col(9) == x.col(1));
}

TEST_CASE("at the ends the error stays small and falls away within a few samples") {
  // Up to the last sample; the four columns behind it are extrapolated.
  const Matrix error =
      (interpolate(tone(10, 200, 2000), 5, Interpolation::band_limited) - tone(10, 1000, 10000)).cwiseAbs();
  CHECK(error.leftCols(9996).maxCoeff() < 5e-3);
  CHECK(error.middleCols(25, 9950).maxCoeff() < 3e-4);
  CHECK(error.middleCols(50, 9900).maxCoeff() < 1e-4);
  CHECK(error.rightCols(4).maxCoeff() < 0.1);
}

TEST_CASE("interpolation is linear, commutes with a shift and with reversing time") {
  const Matrix a = Random(4, Stream::road).normal(1, 200), b = Random(5, Stream::road).normal(1, 200);
  for (Interpolation kind : kKinds) {
    const Matrix sum = interpolate(2 * a - 3 * b, 4, kind);
    CHECK((sum - 2 * interpolate(a, 4, kind) + 3 * interpolate(b, 4, kind)).cwiseAbs().maxCoeff() < 1e-12);
    const Matrix shifted = interpolate(a.rightCols(190), 4, kind);
    CHECK((shifted - interpolate(a, 4, kind).rightCols(760)).middleCols(140, 400).cwiseAbs().maxCoeff() < 1e-13);
  }
  const Matrix forward = interpolate(a, 4, Interpolation::band_limited);
  const Matrix backward = interpolate(a.rowwise().reverse(), 4, Interpolation::band_limited).rowwise().reverse();
  // Column j of the one lies at instant j, of the other at j - 3 (the last interval changes its end).
  CHECK((forward.leftCols(797) - backward.rightCols(797)).cwiseAbs().maxCoeff() < 1e-12);
}

TEST_CASE("names and wrong arguments") {
  for (const std::string& name : interpolation_names()) CHECK_NOTHROW(interpolation_from(name));
  CHECK(interpolation_from("zoh") == Interpolation::zoh);
  CHECK_THROWS_AS(interpolation_from("cubic"), std::invalid_argument);
  const Matrix x = Matrix::Ones(1, 4);
  CHECK_THROWS_AS(interpolate(x, 0, Interpolation::zoh), std::invalid_argument);
  CHECK_THROWS_AS(interpolate(x, 0.0, 10.0, Interpolation::zoh), std::invalid_argument);
  CHECK_THROWS_AS(interpolate(x, 10.0, -1.0, Interpolation::zoh), std::invalid_argument);
  CHECK_THROWS_AS(interpolate(x, 10.0, std::nan(""), Interpolation::zoh), std::invalid_argument);
  CHECK(interpolate(Matrix(2, 0), 5, Interpolation::band_limited).cols() == 0);
}
