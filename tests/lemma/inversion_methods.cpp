// What every input reconstruction owes: f back at its own sample, and where theory makes two methods one.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "tests/support/pieces.hpp"
#include "tests/support/systems.hpp"
#include "variants/inversion/devasia.hpp"
#include "variants/inversion/hou_patton.hpp"
#include "variants/inversion/sdi.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

namespace {

Matrix smooth_input(Index q, Index samples) {
  Matrix f(q, samples);
  for (Index i = 0; i < q; ++i)
    for (Index k = 0; k < samples; ++k) {
      const double t = static_cast<double>(k), w = 0.05 * static_cast<double>(i + 1);
      f(i, k) = std::sin(w * t) + 0.5 * std::cos(0.6 * w * t);
    }
  return f;
}

Reconstruction invert(const InputReconstructor& method, const LinearModel& system, const Matrix& z) {
  return without_delay(method.reconstruct(system.A, system.C, system.B, system.D, z, Vector::Ones(z.rows())));
}

/// Relative error on the samples that a method vouches for, but for the first hundred and the last.
double error_inside(const Reconstruction& found, const Matrix& f) {
  const Index first = std::max<Index>(found.first, 100), last = std::min<Index>(found.last, f.cols() - 100);
  REQUIRE(last > first);
  return relative_error(found.f.middleCols(first, last - first), f.middleCols(first, last - first));
}

/// One input and one output with poles 0.5, 0.7 and the given zero: a direct term, or a delay of one sample.
LinearModel with_zero(double zero, bool direct) {
  // H(z) = (z - zero) (z - 0.2) / ((z - 0.5) (z - 0.7)), or (z - zero) over the same; controllable form.
  LinearModel system;
  system.A = (Matrix(2, 2) << 1.2, -0.35, 1, 0).finished();
  system.B = (Matrix(2, 1) << 1, 0).finished();
  const double b1 = direct ? -(zero + 0.2) : 1, b0 = direct ? 0.2 * zero : -zero;
  system.D = Matrix::Constant(1, 1, direct ? 1 : 0);
  system.C = (Matrix(1, 2) << b1 + system.D(0, 0) * 1.2, b0 - system.D(0, 0) * 0.35).finished();
  system.y0 = Vector::Zero(1);
  return system;
}

}  // namespace

TEST_CASE("every inversion: f comes back from a noise-free residual, at its own sample, with and without direct term") {
  Random random = numbers(161);
  for (const Index q : {1, 2})
    for (const bool direct : {true, false}) {
      LinearModel system = random_linear(4, q, 3, 0.85, random);
      if (!direct) system.D.setZero();
      const Matrix f = smooth_input(q, 1500), z = simulate(system, f, Vector::Zero(4)).y;
      for (const auto& [name, method] : pieces_of(inversion_table())) {
        CAPTURE(name, q, direct);
        const Reconstruction found = invert(*method, system, z);
        CAPTURE(found.message, found.first, found.last);
        REQUIRE(found.status == Status::ok);
        CHECK(found.delay == 0);
        CHECK(found.f.cols() == z.cols());
        // The random walk of stable dynamic inversion is an assumption that costs accuracy; the others make none.
        CHECK(error_inside(found, f) < (name == "sdi" ? 0.02 : 0.011));
      }
    }
}

TEST_CASE(
    "a declared delay is undone in one place: the observer without direct term is one sample late, then on time") {
  Random random = numbers(162);
  LinearModel system = random_linear(3, 1, 2, 0.8, random);
  const Matrix f = smooth_input(1, 800);
  for (const bool direct : {true, false}) {
    if (!direct) system.D.setZero();
    const Matrix z = simulate(system, f, Vector::Zero(3)).y;
    const Reconstruction late =
        make_hou_patton({})->reconstruct(system.A, system.C, system.B, system.D, z, Vector::Ones(2));
    REQUIRE(late.status == Status::ok);
    CHECK(late.delay == (direct ? 0 : 1));
    const Reconstruction on_time = without_delay(late);
    CHECK(error_inside(on_time, f) < 1e-10);
    CHECK(on_time.last == z.cols() - late.delay);
    if (!direct) CHECK(relative_error(late.f.middleCols(101, 600), f.middleCols(100, 600)) < 1e-10);
  }
}

TEST_CASE("Hou and Patton's observer is the filtered stable dynamic inversion for Q_eta to infinity") {
  Random random = numbers(163);
  for (const Index q : {1, 2}) {
    const LinearModel system = random_linear(4, q, 4, 0.85, random);
    const Matrix z = simulate(system, smooth_input(q, 800), Vector::Zero(4)).y + 0.1 * random.normal(4, 800);
    const Matrix observer = invert(*make_hou_patton({}), system, z).f;
    double previous = 1;
    for (const double variance : {1.0, 1e2, 1e4, 1e6}) {
      const Matrix filtered = invert(*make_sdi({.read_out = "filtered", .input_variance = variance}), system, z).f;
      const double distance = relative_error(filtered.rightCols(700), observer.rightCols(700));
      CAPTURE(q, variance, distance);
      CHECK(distance < previous);
      previous = distance;
    }
    CHECK(previous < 1e-4);
  }
}

TEST_CASE(
    "Devasia's inversion is stable dynamic inversion where there is no noise and every zero is inside the circle") {
  const LinearModel system = with_zero(0.6, true);
  const Matrix z = simulate(system, smooth_input(1, 800), Vector::Zero(2)).y;
  const Matrix devasia = invert(*make_devasia({.square_down = "channel"}), system, z).f;
  const Matrix sdi = invert(*make_sdi({.read_out = "filtered", .input_variance = 1e8}), system, z).f;
  CHECK(relative_error(devasia.middleCols(100, 600), sdi.middleCols(100, 600)) < 1e-5);
}

TEST_CASE("Devasia: a zero outside the circle runs backward in time, where a causal inverse would blow up") {
  for (const bool direct : {true, false})
    for (const double zero : {1.3, -1.5, 4.0}) {
      const LinearModel system = with_zero(zero, direct);
      const Matrix f = smooth_input(1, 600), z = simulate(system, f, Vector::Zero(2)).y;
      const Reconstruction found = invert(*make_devasia({.square_down = "channel"}), system, z);
      CAPTURE(zero, direct, found.message);
      REQUIRE(found.status == Status::ok);
      CHECK(found.last < z.cols());  // the end is not known, and said so
      CHECK(error_inside(found, f) < 1e-8);
      // The observer knows no way around such a zero with one output, and says which condition fails.
      const Reconstruction causal = invert(*make_hou_patton({}), system, z);
      CHECK(causal.status == Status::not_stabilisable);
      CHECK_THAT(causal.message,
                 Catch::Contains("condition 2") && Catch::Contains(fmt::format("{:g}", std::abs(zero))));
    }
}

TEST_CASE("Devasia: a zero near the unit circle is a status with its distance, not a blow-up") {
  for (const double distance : {1e-3, -1e-3, 1e-5, -1e-6, 0.0}) {
    const LinearModel system = with_zero(1 - distance, true);
    const Matrix z = simulate(system, smooth_input(1, 600), Vector::Zero(2)).y;
    const Reconstruction found = invert(*make_devasia({.square_down = "channel"}), system, z);
    CAPTURE(distance, found.message);
    CHECK(found.status == Status::not_stabilisable);
    CHECK_THAT(found.message, Catch::Contains("unit circle") && Catch::Contains("600"));
  }
  // A longer record forgets the start of a zero that a short one does not.
  const LinearModel system = with_zero(0.999, true);
  const Matrix f = smooth_input(1, 12000);
  const Reconstruction found =
      invert(*make_devasia({.square_down = "channel"}), system, simulate(system, f, Vector::Zero(2)).y);
  REQUIRE(found.status == Status::ok);
  CHECK(found.first > 4000);
  CHECK(error_inside(found, f) < 0.02);
}

TEST_CASE("Devasia: every way to square down finds f, and the combination is the same for the same seed") {
  Random random = numbers(164);
  const LinearModel system = random_linear(4, 1, 3, 0.85, random);
  const Matrix f = smooth_input(1, 1500), z = simulate(system, f, Vector::Zero(4)).y;
  Index found_by = 0;
  for (const char* way : {"channel", "direct_term", "combinations"}) {
    const Reconstruction found = invert(*make_devasia({.square_down = way}), system, z);
    CAPTURE(way, found.message);
    if (found.status == Status::not_stabilisable) continue;  // of one combination, zeros may be anywhere
    ++found_by;
    CHECK(error_inside(found, f) < 0.011);
  }
  CHECK(found_by >= 1);
  const auto draw = [&](Index seed) { return invert(*make_devasia({.combinations = 5, .seed = seed}), system, z).f; };
  CHECK(same_bits(draw(3), draw(3)));
  CHECK_FALSE(same_bits(draw(3), draw(4)));
  const Reconstruction beyond = invert(*make_devasia({.square_down = "channel", .channel = 3}), system, z);
  CHECK(beyond.status == Status::rank_deficient);
  CHECK_THAT(beyond.message, Catch::Contains("3 outputs"));
}

TEST_CASE("Devasia: unknown inputs that show at different samples are refused, not inverted wrongly") {
  Random random = numbers(166);
  LinearModel system = random_linear(4, 2, 2, 0.85, random);
  system.D.col(1) = 2 * system.D.col(0);  // one combination of the inputs shows at once, the other a sample later
  const Reconstruction refused =
      invert(*make_devasia({}), system, simulate(system, smooth_input(2, 600), Vector::Zero(4)).y);
  CHECK(refused.status == Status::rank_deficient);
  CHECK_THAT(refused.message, Catch::Contains("relative degree"));
}

TEST_CASE("existence conditions: more unknown inputs than the direct term shows are refused by number") {
  Random random = numbers(165);
  LinearModel system = random_linear(4, 2, 3, 0.85, random);
  system.D.col(1) = 2 * system.D.col(0);
  const Matrix z = simulate(system, smooth_input(2, 400), Vector::Zero(4)).y;
  const Reconstruction refused = invert(*make_hou_patton({}), system, z);
  CHECK(refused.status == Status::rank_deficient);
  CHECK_THAT(refused.message, Catch::Contains("condition 1") && Catch::Contains("rank 1") && Catch::Contains("2"));
}
