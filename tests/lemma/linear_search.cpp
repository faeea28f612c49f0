// A linear model of a record of which nothing is known but its channels.
#include "core/identify/linear_search.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "core/data/metrics.hpp"
#include "core/identify/input_matrices.hpp"
#include "core/identify/pole_search.hpp"
#include "tests/support/drawn_plants.hpp"
#include "variants/solver/levenberg_marquardt.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

namespace {

/// Largest distance of a wanted eigenvalue from the nearest found one.
double distance(const ComplexVector& wanted, const ComplexVector& found) {
  double farthest = 0;
  for (const std::complex<double>& value : wanted)
    farthest = std::max(farthest, (found.array() - value).abs().minCoeff());
  return farthest;
}

}  // namespace

TEST_CASE("block averages of no more samples than moments keep all of the inputs") {
  Random random = numbers(500);
  const Matrix u = random.normal(2, 60), y = random.normal(3, 60);
  for (const Index stride : {1, 2, 3}) {
    const BlockAverages data = block_averages(u, y, stride, 3);
    CHECK(data.u.rows() == 2 * stride);
    CHECK(data.u.squaredNorm() == Approx(u.squaredNorm()).epsilon(1e-12));
    CHECK(data.y.cols() == 60 / stride);
    CHECK(data.y.rowwise().mean().isApprox(y.rowwise().mean(), 1e-12));
  }
  CHECK(block_averages(u, y, 7, 3).u.rows() == 6);
}

TEST_CASE("the poles of drawn plants are found at every rate, whatever the delays of their inputs") {
  for (std::uint64_t draw = 0; draw < 8; ++draw) {
    Random random = numbers(510 + draw);
    // Periods of the fastest mode from 6 to 150 samples; lightly damped, so that the gap leaves something of it.
    const double period = 6 * std::pow(25.0, random.uniform());
    const DelayedPlant plant = drawn_plant({.pairs = 1 + random.integer(2),
                                            .inputs = 1 + random.integer(2),
                                            .outputs = 2,
                                            .period = period,
                                            .most_damping = 0.05,
                                            .longest_delay = 8},
                                           random);
    const Matrix u = random.normal(plant.model.input_count(), 4000);
    const Matrix y = respond(plant, u);
    PoleSearchOptions options;
    options.gap = 8;
    options.lowest_order = options.highest_order = plant.model.order();
    const std::vector<PoleSet> sets = pole_sets(u, y, options).front();
    double nearest = std::numeric_limits<double>::infinity();
    for (const PoleSet& set : sets)
      nearest = std::min(nearest, distance(eigenvalues(plant.model.A), eigenvalues(set.A)));
    CAPTURE(draw, period, plant.model.order(), sets.size(), nearest);
    CHECK(nearest * period < 0.02);
  }
}

TEST_CASE("the order, the delays and the rate of drawn linear plants are found: the free run is at the noise") {
  const auto solver = make_levenberg_marquardt({});
  int good = 0;
  constexpr int draws = 12;
  for (std::uint64_t draw = 0; draw < draws; ++draw) {
    Random random = numbers(530 + draw);
    const double period = 5 * std::pow(20.0, random.uniform());
    const DelayedPlant plant = drawn_plant({.pairs = 1 + random.integer(2),
                                            .inputs = 1 + random.integer(2),
                                            .outputs = 1 + random.integer(2),
                                            .period = period,
                                            .longest_delay = 10},
                                           random);
    const Index N = 2500;
    const Matrix u = random.normal(plant.model.input_count(), N), fresh = random.normal(plant.model.input_count(), N);
    const Matrix clean = respond(plant, u), wanted = respond(plant, fresh);
    const double noise = std::pow(10.0, -1.5 - random.uniform());  // of the RMS
    const Vector scale = rms(clean);
    Matrix y = scale.cwiseInverse().asDiagonal() * clean;
    y += noise * random.normal(y.rows(), N);
    const LinearSearch found = search_linear(u, y, 0, {.max_order = 8, .max_delay = 12}, *solver);
    REQUIRE(found.estimate.status == Status::ok);
    const Matrix acting = delayed(fresh, found.delay);
    const Matrix reference = (scale.cwiseInverse().asDiagonal() * wanted).rightCols(acting.cols());
    const Vector x0 = estimate_initial_state(found.estimate.model, acting, reference, N / 2);
    const Vector error = rms(simulate(found.estimate.model, acting, x0).y - reference);
    const double ratio = (error.array().square() / (noise * noise) + 1).sqrt().maxCoeff();
    CAPTURE(draw, period, plant.model.order(), found.estimate.order_used, noise, ratio);
    CHECK(ratio < 3);
    good += ratio < 1.1;
  }
  CHECK(good >= draws - 1);
}

TEST_CASE("inputs as they act: every row is late by its own delay") {
  Random random = numbers(550);
  const Matrix u = random.normal(3, 50);
  const std::vector<Index> delay = {0, 4, 2};
  const Matrix acting = delayed(u, delay);
  REQUIRE(acting.cols() == 46);
  for (Index i = 0; i < 3; ++i)
    for (Index k = 0; k < 46; ++k) REQUIRE(acting(i, k) == u(i, k + 4 - delay[static_cast<std::size_t>(i)]));
}
