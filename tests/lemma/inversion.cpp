// Stable dynamic inversion, Sec. 2.5: Lemmas 5 and 6, and what the read-outs recover.
#include <catch2/catch.hpp>
#include <cmath>

#include "core/kernels/kalman.hpp"
#include "core/plant/linearise.hpp"
#include "tests/support/plants.hpp"
#include "tests/support/systems.hpp"
#include "variants/inversion/sdi.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

namespace {

struct Augmented {
  Matrix A, C, Q;
};

/// eqs. (19)-(20) with the direct term, a random walk as input.
Augmented augment(const LinearModel& system, double input_variance) {
  const Index n = system.order(), q = system.input_count(), p = system.output_count();
  Augmented a{Matrix::Identity(n + q, n + q), Matrix(p, n + q), Matrix::Zero(n + q, n + q)};
  a.A.topLeftCorner(n, n) = system.A;
  a.A.topRightCorner(n, q) = system.B;
  a.C << system.C, system.D;
  a.Q.bottomRightCorner(q, q).diagonal().setConstant(input_variance);
  return a;
}

/// Smallest singular value of [A - z I; C] relative to the largest: zero where the mode z is unobservable.
double observability_at(const Augmented& a, std::complex<double> z) {
  const Index n = a.A.rows(), p = a.C.rows();
  Matrix real(2 * (n + p), 2 * n);  // the complex matrix as a real one; every singular value appears twice
  const Matrix shifted = a.A - z.real() * Matrix::Identity(n, n);
  Matrix top(n + p, n), imaginary = Matrix::Zero(n + p, n);
  top << shifted, a.C;
  imaginary.topRows(n).diagonal().setConstant(-z.imag());
  real << top, -imaginary, imaginary, top;
  const Vector s = svd(real).s;
  return s(s.size() - 1) / s(0);
}

double worst_observability(const Augmented& a) {
  double worst = 1;
  for (const auto& z : eigenvalues(a.A)) worst = std::min(worst, observability_at(a, z));
  return worst;
}

/// The quarter car from a force between wheel and body to the given sensors, held over 5 ms, at unit gain a channel.
LinearModel from_suspension_force(const std::vector<int>& sensors) {
  Json text = Json::parse(quarter_car_text);
  text["inputs"].push_back(
      {{"name", "force"}, {"kind", "force"}, {"unit", "N"}, {"between", {"wheel", "body"}}, {"hold_hz", 1000}});
  const LinearPlant plant = linearise(plant_from(text.dump()));
  const DiscreteInput step = discretise_zoh(plant.A, plant.B.col(1), 0.005);
  const Index p = static_cast<Index>(sensors.size());
  LinearModel system{step.A, step.B, Matrix(p, 4), Matrix(p, 1), Vector::Zero(p)};
  for (Index i = 0; i < p; ++i) {
    system.C.row(i) = plant.C.row(sensors[static_cast<std::size_t>(i)]);
    system.D(i, 0) = plant.D(sensors[static_cast<std::size_t>(i)], 1);
    const double gain = std::hypot(system.C.row(i).norm(), system.D.row(i).norm());
    system.C.row(i) /= gain;
    system.D.row(i) /= gain;
  }
  // States scaled by their static or free response, inputs by B: the measures below are relative to the entries.
  const Vector scale = system.B.cwiseAbs().cwiseInverse().col(0);
  system = similarity_transform(system, Matrix(scale.asDiagonal()));
  return system;
}

Matrix steady_gain(const LinearModel& system) {
  const Index n = system.order();
  return system.C * solve(Matrix::Identity(n, n) - system.A, system.B) + system.D;
}

Matrix smooth_input(Index q, Index samples, double phase = 0) {
  Matrix f(q, samples);
  for (Index i = 0; i < q; ++i)
    for (Index k = 0; k < samples; ++k) {
      const double t = static_cast<double>(k), w = 0.05 * static_cast<double>(i + 1);
      f(i, k) = std::sin(w * t + phase) + 0.5 * std::cos(0.6 * w * t) - 0.5;
    }
  return f;
}

double rms_inside(const Matrix& f, const Matrix& truth) {
  const Index first = 100, count = truth.cols() - 200;  // both ends lack past or future samples
  return (f - truth).middleCols(first, count).norm() / truth.middleCols(first, count).norm();
}

Reconstruction invert(const LinearModel& system, const Matrix& z, const SdiOptions& options, double sign = 1) {
  return make_sdi(options)->reconstruct(system.A, system.C, sign * system.B, sign * system.D, z,
                                        Vector::Ones(z.rows()));
}

}  // namespace

TEST_CASE("Lemma 5: the augmented pair loses observability exactly when z = 1 becomes a zero of the plant") {
  Random random = numbers(41);
  for (const bool direct : {false, true}) {
    LinearModel system = random_linear(4, 1, 2, 0.8, random);
    if (!direct) system.D.setZero();
    CHECK(worst_observability(augment(system, 1)) > 1e-4);
    if (direct) {
      system.D -= steady_gain(system);
    } else {
      const Vector x = solve(Matrix::Identity(4, 4) - system.A, system.B).col(0);
      system.C -= system.C * x * x.transpose() / x.squaredNorm();  // C (I - A)^-1 B = 0
    }
    CHECK(steady_gain(system).norm() < 1e-14);
    CHECK(worst_observability(augment(system, 1)) < 1e-14);
    // At the eigenvalues of A nothing has changed: the pair (C, A) itself is still observable.
    for (const auto& z : eigenvalues(system.A)) CHECK(observability_at(augment(system, 1), z) > 1e-4);
  }
}

TEST_CASE("Lemma 5: accelerations alone do not show a constant suspension force, the suspension travel does") {
  const LinearModel all = from_suspension_force({0, 1, 2}), accelerations = from_suspension_force({1, 2});
  const double with_travel = observability_at(augment(all, 1), 1),
               without = observability_at(augment(accelerations, 1), 1);
  CAPTURE(with_travel, without);
  CHECK(without < 1e-13);
  CHECK(with_travel > 1e6 * without);

  const auto status = [](const LinearModel& system) {
    const Augmented a = augment(system, 1);
    return solve_dare(a.A, a.C, a.Q, Matrix::Identity(a.C.rows(), a.C.rows())).status;
  };
  CHECK(status(all) == Status::ok);
  CHECK(status(accelerations) != Status::ok);
  const Matrix z = simulate(accelerations, smooth_input(1, 400), Vector::Zero(4)).y;
  const Reconstruction lost = invert(accelerations, z, {.input_variance = 1});
  CHECK(lost.status != Status::ok);
  CHECK_FALSE(lost.message.empty());
  // An input model with its pole inside the circle needs no zero to be absent.
  CHECK(invert(accelerations, z, {.input_variance = 1, .input_pole = 0.99}).status == Status::ok);
}

TEST_CASE("Lemma 6: every eigenvalue of A is a zero of the inverse system (21)") {
  Random random = numbers(42);
  for (const Index q : {1, 2})
    for (const bool direct : {false, true}) {
      LinearModel system = random_linear(4, q, q, 0.8, random);
      if (!direct) system.D.setZero();
      const Augmented a = augment(system, 1);
      const KalmanFilter filter = design_kalman_filter(a.A, a.C, a.Q, Matrix::Identity(q, q));
      REQUIRE(filter.status == Status::ok);
      const Index size = 4 + q;
      const auto rosenbrock = [&](std::complex<double> z) {  // smallest over largest singular value
        const Matrix closed = filter.A - filter.K * filter.C;
        Matrix M = Matrix::Zero(size + q, size + q), I = Matrix::Zero(size + q, size + q);
        M.topLeftCorner(size, size) = -closed;
        M.topRightCorner(size, q) = -filter.K;
        M.block(size, 4, q, q).setIdentity();
        I.topLeftCorner(size, size).setIdentity();
        Matrix real(2 * (size + q), 2 * (size + q));
        real << M + z.real() * I, -z.imag() * I, z.imag() * I, M + z.real() * I;
        const Vector s = svd(real).s;
        return s(s.size() - 1) / s(0);
      };
      for (const auto& pole : eigenvalues(system.A)) {
        CHECK(rosenbrock(pole) < 1e-13);
        CHECK(rosenbrock(pole + std::complex<double>(0.05, 0.05)) > 1e-6);
      }
    }
}

TEST_CASE("Lemma 6 for more outputs than inputs: the free response of the plant gives no auxiliary input") {
  Random random = numbers(43);
  const LinearModel system = random_linear(4, 1, 3, 0.9, random);
  const Augmented a = augment(system, 1);
  const KalmanFilter filter = design_kalman_filter(a.A, a.C, a.Q, Matrix::Identity(3, 3));
  Vector x0 = Vector::Zero(5);
  x0.head(4) = random.normal(4, 1);
  const Matrix free = simulate(system, Matrix::Zero(1, 200), x0.head(4)).y;
  const FilterRun run = run_filter(filter, free, x0);
  CHECK(run.x.row(4).norm() < 1e-12 * free.norm());
  CHECK(run.e.norm() < 1e-12 * free.norm());
}

TEST_CASE("eq. (18)-(21): f comes back from noise-free residuals, and a longer look-ahead brings it closer") {
  Random random = numbers(44);
  for (const Index q : {1, 2}) {
    const LinearModel system = random_linear(4, q, 3, 0.85, random);
    const Matrix f = smooth_input(q, 1200);
    const Matrix z = simulate(system, f, Vector::Zero(4)).y;
    double previous = 1;
    for (const char* read_out : {"predictor", "filtered", "fixed_lag", "smoothed"}) {
      // A ratio of 1 leaves the filter a memory of a few samples, so that the read-outs differ.
      const Reconstruction result = invert(system, z, {.read_out = read_out, .lag = 10, .input_variance = 1});
      REQUIRE(result.status == Status::ok);
      CHECK(result.spectral_radius < 1);
      const double error = rms_inside(result.f, f);
      CAPTURE(q, read_out, error);
      CHECK(error < 0.2);
      // The filter is optimal for a random walk; for this f the last samples of look-ahead need not help any more.
      CHECK(error <= previous * (read_out == std::string("smoothed") ? 1.1 : 1.0));
      previous = error;
    }
    const Reconstruction automatic = invert(system, z, {});
    REQUIRE(automatic.status == Status::ok);
    // Without noise the likelihood prefers a wide-awake filter: the error left is that of the random-walk assumption.
    CHECK(automatic.input_variance >= 1e2);
    CHECK(rms_inside(automatic.f, f) < 1e-3);
  }
}

TEST_CASE("the smoothed read-out is the fixed-lag read-out that looks to the end of the record") {
  Random random = numbers(45);
  const LinearModel system = random_linear(3, 1, 2, 0.9, random);
  const Matrix z = simulate(system, smooth_input(1, 300), Vector::Zero(3)).y + 0.1 * random.normal(2, 300);
  const Matrix smoothed = invert(system, z, {.read_out = "smoothed", .input_variance = 0.01}).f;
  const Matrix lagged = invert(system, z, {.read_out = "fixed_lag", .lag = 300, .input_variance = 0.01}).f;
  CHECK(relative_error(lagged, smoothed) < 1e-10);
  CHECK(relative_error(invert(system, z, {.read_out = "fixed_lag", .lag = 2, .input_variance = 0.01}).f, smoothed) >
        1e-3);
}

TEST_CASE("the likelihood finds the level of the input noise, and noise costs accuracy but not the signal") {
  Random random = numbers(46);
  const LinearModel system = random_linear(4, 1, 3, 0.85, random);
  Matrix f = random.normal(1, 3000);
  for (Index k = 1; k < f.cols(); ++k) f(0, k) = f(0, k - 1) + 0.1 * f(0, k);        // Q_eta = 0.01
  const Matrix z = simulate(system, f, Vector::Zero(4)).y + random.normal(3, 3000);  // R_v = 1
  const Reconstruction result = invert(system, z, {.read_out = "smoothed"});
  REQUIRE(result.status == Status::ok);
  CHECK(result.input_variance >= 0.9e-3);  // the grid has one value a decade
  CHECK(result.input_variance <= 1.1e-1);
  CHECK(rms_inside(result.f, f) < 0.2);
}

TEST_CASE("the sign of [Bt, Dt] is the sign of f: turning one turns the other") {
  Random random = numbers(47);
  const LinearModel system = random_linear(4, 1, 2, 0.85, random);
  const Matrix f = smooth_input(1, 600), z = simulate(system, f, Vector::Zero(4)).y;
  const Matrix upright = invert(system, z, {.input_variance = 100}).f;
  const Matrix turned = invert(system, z, {.input_variance = 100}, -1).f;
  CHECK(relative_error(-turned, upright) < 1e-9);
  CHECK((upright.array() * f.array()).sum() > 0.99 * upright.norm() * f.norm());
}
