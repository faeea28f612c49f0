// Stated uncertainties of identified models hold what they promise.
#include "core/identify/uncertainty.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "core/data/metrics.hpp"
#include "core/identify/free_run_problem.hpp"
#include "tests/support/drawn_plants.hpp"
#include "variants/solver/levenberg_marquardt.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

namespace {

/// Noise of unit variance, white or with a correlation time of 1 / (1 - pole) samples.
Matrix noise_of(Index outputs, Index samples, double pole, Random& random) {
  Matrix e = random.normal(outputs, samples);
  for (Index k = 1; k < samples; ++k) e.col(k) = pole * e.col(k - 1) + std::sqrt(1 - pole * pole) * e.col(k);
  return e;
}

/// Shares of stated 90 % intervals that hold the truth.
struct Coverage {
  double poles = 0, responses = 0, wanted_poles = 0, wanted_responses = 0;
  Vector stated, actual;  // mean squares of the free run's deviation
};

Coverage coverage(double noise_pole, Index draws) {
  const std::unique_ptr<Solver> solver = make_levenberg_marquardt({});
  Coverage total;
  total.stated = total.actual = Vector::Zero(2);
  for (Index draw = 0; draw < draws; ++draw) {
    Random random = numbers(640 + static_cast<std::uint64_t>(draw));
    const DelayedPlant plant = drawn_plant({.pairs = 2, .outputs = 2, .period = 8}, random);
    const Matrix u = random.normal(1, 1500);
    const Matrix clean = simulate(plant.model, u, Vector::Zero(4)).y;
    const Matrix y = clean + 0.05 * rms(clean).asDiagonal() * noise_of(2, 1500, noise_pole, random);
    std::vector<FittedRecord> fit{{u, y, 0, Vector::Zero(4)}};
    const Refinement refined = refine(without_map(plant.model), fit, Vector::Ones(2), *solver, 30);
    const std::vector<double> frequencies{0.05, 0.2, 0.5, 1.2};
    const ModelUncertainty found = model_uncertainty(refined.model, {{u, y, 0, fit[0].x0}}, frequencies);
    REQUIRE(found.known());
    const ModelUncertainty truth =
        model_uncertainty(without_map(plant.model), {{u, y, 0, Vector::Zero(4)}}, frequencies);
    for (const UncertainPole& pole : found.poles) {
      if (!(pole.pole.imag() > 0)) continue;
      const UncertainPole* nearest = &truth.poles.front();
      for (const UncertainPole& other : truth.poles)
        if (std::abs(other.pole - pole.pole) < std::abs(nearest->pole - pole.pole)) nearest = &other;
      total.wanted_poles += 2;
      total.poles += std::abs(pole.frequency - nearest->frequency) < kNinetyPercent * pole.frequency_std;
      total.poles += std::abs(pole.damping - nearest->damping) < kNinetyPercent * pole.damping_std;
    }
    for (std::size_t k = 0; k < frequencies.size(); ++k)
      for (Index i = 0; i < 2; ++i) {
        const auto& own = found.responses[k];
        const std::complex<double> error = own.value(i) - truth.responses[k].value(i);
        total.wanted_responses += 3;
        total.responses += std::abs(error.real()) < kNinetyPercent * own.real_std(i);
        total.responses += std::abs(error.imag()) < kNinetyPercent * own.imaginary_std(i);
        total.responses += std::abs(std::abs(own.value(i)) - std::abs(truth.responses[k].value(i))) <
                           kNinetyPercent * own.magnitude_std(i);
      }
    total.stated += found.output_std.cwiseAbs2();
    total.actual += (free_run(refined.model, u, fit[0].x0).y - clean).rowwise().squaredNorm() / 1500;
  }
  return total;
}

}  // namespace

TEST_CASE("90 % intervals of poles and responses hold the truth as often as they say, white noise or coloured",
          "[slow]") {
  for (const double noise_pole : {0.0, 0.8}) {
    const Coverage found = coverage(noise_pole, 60);
    CAPTURE(noise_pole, found.poles / found.wanted_poles, found.responses / found.wanted_responses);
    CHECK(found.poles / found.wanted_poles > 0.85);
    CHECK(found.poles / found.wanted_poles < 0.95);
    CHECK(found.responses / found.wanted_responses > 0.85);
    CHECK(found.responses / found.wanted_responses < 0.95);
    for (Index i = 0; i < 2; ++i) CHECK(std::sqrt(found.stated(i) / found.actual(i)) == Approx(1).margin(0.25));
  }
}

TEST_CASE("the uncertainty does not depend on the coordinates of the states, and falls as the noise") {
  Random random = numbers(641);
  const DelayedPlant plant = drawn_plant({.pairs = 1, .outputs = 1, .period = 10}, random);
  const Matrix u = random.normal(1, 800), e = random.normal(1, 800);
  const Matrix clean = simulate(plant.model, u, Vector::Zero(2)).y;
  const auto found = [&](const LinearModel& model, double noise) {
    return model_uncertainty(without_map(model), {{u, clean + noise * e, 0, Vector::Zero(2)}}, {0.1, 1.0});
  };
  const ModelUncertainty here = found(plant.model, 0.1);
  const Matrix T = random.normal(2, 2) + 2 * Matrix::Identity(2, 2);
  const ModelUncertainty there = found(similarity_transform(plant.model, T), 0.1), louder = found(plant.model, 0.2);
  REQUIRE(here.known());
  for (std::size_t i = 0; i < 2; ++i) {
    CHECK(there.poles[i].frequency_std == Approx(here.poles[i].frequency_std).epsilon(1e-4));
    CHECK(louder.poles[i].damping_std == Approx(2 * here.poles[i].damping_std).epsilon(1e-6));
    CHECK(there.responses[i].magnitude_std(0) == Approx(here.responses[i].magnitude_std(0)).epsilon(1e-4));
    CHECK(there.responses[i].imaginary_std(0) == Approx(here.responses[i].imaginary_std(0)).epsilon(1e-4));
  }
  CHECK(there.output_std(0) == Approx(here.output_std(0)).epsilon(1e-4));
}

TEST_CASE("two halves of a record, each with its own start, say what the whole says") {
  Random random = numbers(642);
  const DelayedPlant plant = drawn_plant({.pairs = 1, .outputs = 2, .period = 10, .most_damping = 0.3}, random);
  const Matrix u = random.normal(1, 2000);
  const Response run = simulate(plant.model, u, Vector::Zero(2));
  const Matrix y = run.y + 0.1 * random.normal(2, 2000);
  const NonlinearModel model = without_map(plant.model);
  const ModelUncertainty whole = model_uncertainty(model, {{u, y, 0, Vector::Zero(2)}}, {0.5});
  const ModelUncertainty halves = model_uncertainty(model,
                                                    {{u.leftCols(1000), y.leftCols(1000), 0, Vector::Zero(2)},
                                                     {u.rightCols(1000), y.rightCols(1000), 0, run.x.col(1000)}},
                                                    {0.5});
  CHECK(halves.poles[0].frequency_std == Approx(whole.poles[0].frequency_std).epsilon(0.1));
  CHECK(halves.responses[0].real_std(1) == Approx(whole.responses[0].real_std(1)).epsilon(0.1));
  CHECK(halves.blocks == whole.blocks);
}

TEST_CASE("a delay turns the response and leaves its magnitude, frequencies ascend to below half the sampling rate") {
  Random random = numbers(643);
  const DelayedPlant plant = drawn_plant({.pairs = 1, .period = 10}, random);
  const Matrix u = random.normal(1, 300);
  const Matrix y = simulate(plant.model, u, Vector::Zero(2)).y + random.normal(1, 300);
  const std::vector<StartedRecord> records{{u, y, 0, Vector::Zero(2)}};
  const NonlinearModel model = without_map(plant.model);
  const auto plain = model_uncertainty(model, records, {0.7}), late = model_uncertainty(model, records, {0.7}, {3});
  const std::complex<double> turned = plain.responses[0].value(0) * std::polar(1.0, -2.1);
  CHECK(std::abs(late.responses[0].value(0) - turned) < 1e-12);
  CHECK(late.responses[0].magnitude_std(0) == Approx(plain.responses[0].magnitude_std(0)).epsilon(1e-6));
  for (const Index samples : {10, 1000, 1000000}) {
    const std::vector<double> frequencies = response_frequencies(samples);
    CHECK(std::is_sorted(frequencies.begin(), frequencies.end()));
    CHECK(frequencies.front() > 0);
    CHECK(frequencies.back() < 3.1416);
  }
}

TEST_CASE("too few samples for the parameters: nothing is stated") {
  Random random = numbers(644);
  const NonlinearModel model = random_nonlinear(3, 1, 1, 1, random);
  const Matrix u = random.normal(1, 20);
  CHECK_FALSE(model_uncertainty(model, {{u, random.normal(1, 20), 0, Vector::Zero(3)}}, {0.5}).known());
}

TEST_CASE("between the lines of a multisine nothing is stated, on them it is") {
  Random random = numbers(645);
  const DelayedPlant plant = drawn_plant({.pairs = 2, .period = 10}, random);
  Matrix u(1, 2000);
  const double pi = 3.14159265358979323846;
  for (Index k = 0; k < 2000; ++k)
    u(0, k) = std::sin(2 * pi * static_cast<double>(k) / 20) + std::cos(2 * pi * static_cast<double>(k) / 50);
  // From the steady state on: what begins and dies out would tell more.
  const Vector x0 = simulate(plant.model, u, Vector::Zero(4)).x.col(1900);
  const Matrix y = simulate(plant.model, u, x0).y;
  const Matrix noisy = y + 0.01 * random.normal(1, 2000);
  const auto found = model_uncertainty(without_map(plant.model), {{u, noisy, 0, x0}}, {2 * pi / 20, 0.9});
  REQUIRE(found.known());
  CHECK(found.responses[0].magnitude_std(0) < 0.1 * std::abs(found.responses[0].value(0)) + 0.01);
  CHECK(found.responses[1].magnitude_std(0) > 10 * found.responses[0].magnitude_std(0));
}
