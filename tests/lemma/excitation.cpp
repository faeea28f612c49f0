// What a drive excites, judged by what the outputs follow, and whether what a model leaves is noise.
#include "core/identify/excitation.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "core/identify/residual_share.hpp"
#include "tests/support/drawn_plants.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

namespace {

Matrix sines(Index count, Index samples, Random& random) {
  Matrix u = Matrix::Zero(1, samples);
  for (Index i = 0; i < count; ++i) {
    const double w = 0.02 * std::pow(30.0, (static_cast<double>(i) + random.uniform()) / static_cast<double>(count));
    const double phase = 6 * random.uniform();
    for (Index k = 0; k < samples; ++k) u(0, k) += std::sin(w * static_cast<double>(k) + phase);
  }
  return u;
}

}  // namespace

TEST_CASE("a sine is a sine however noisily its drive and its response are measured, two are more") {
  for (std::uint64_t draw = 0; draw < 10; ++draw) {
    Random random = numbers(600 + draw);
    const DelayedPlant plant = drawn_plant({.pairs = 2, .outputs = 2, .period = 8 + 40 * random.uniform()}, random);
    const double of_drive = 1e-4 * std::pow(300.0, random.uniform()),
                 of_outputs = 1e-3 * std::pow(30.0, random.uniform());
    const auto followed = [&](const Matrix& u) {
      Matrix y = respond(plant, u);
      y += of_outputs * y.norm() / std::sqrt(static_cast<double>(y.size())) * random.normal(y.rows(), y.cols());
      const Matrix settled_u = u.rightCols(3000) + of_drive * random.normal(1, 3000);
      return followed_directions(settled_u, y.rightCols(3000), 12);
    };
    CAPTURE(draw, of_drive, of_outputs);
    CHECK(followed(sines(1, 6000, random)) == 2);
    CHECK(followed(sines(2, 6000, random)) >= 3);
    CHECK(followed(random.normal(1, 6000)) > 4);
  }
}

TEST_CASE("outputs that have nothing to do with the inputs follow none of them") {
  Random random = numbers(620);
  for (int draw = 0; draw < 5; ++draw)
    CHECK(followed_directions(random.normal(2, 2000), random.normal(2, 2000), 5) == 0);
}

TEST_CASE("an input made of the others is found, one that only resembles them is not") {
  for (std::uint64_t draw = 0; draw < 6; ++draw) {
    Random random = numbers(630 + draw);
    Matrix u = random.normal(3, 500);
    CHECK(collinear_input(u) == -1);
    u.row(2).rightCols(498) = 2 * u.row(0).leftCols(498) - 0.5 * u.row(1).rightCols(498);
    u.row(2).leftCols(2).setZero();
    CHECK(collinear_input(u.rightCols(480)) >= 0);
    u.row(2) += 0.01 * random.normal(1, 500);
    CHECK(collinear_input(u) == -1);
  }
}

TEST_CASE("the share of a residual that is no noise is that of its slow part") {
  for (std::uint64_t draw = 0; draw < 6; ++draw) {
    Random random = numbers(640 + draw);
    const Index N = 4000;
    const Matrix u = random.normal(1, N);
    const Matrix noise = random.normal(1, N);
    CHECK(residual_share(noise, u)(0) < 0.02);
    Matrix slow = Matrix::Zero(1, N);
    for (Index k = 1; k < N; ++k) slow(0, k) = 0.995 * slow(0, k - 1) + random.normal();
    slow *= std::sqrt(static_cast<double>(N)) / slow.norm();
    const double size = 0.5 + 2 * random.uniform(), expected = size * size / (size * size + 1);
    // A part that moves within ten samples is predicted less well than it is large.
    const double share = residual_share(noise + size * slow, u)(0);
    CAPTURE(draw, size, expected, share);
    CHECK(share < expected + 0.05);
    CHECK(share > 0.5 * expected);
    // What follows the inputs counts wholly.
    CHECK(residual_share(noise + size * u, u)(0) == Approx(expected).margin(0.05));
  }
}
