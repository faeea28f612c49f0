// The initial state of a record that a model was not fitted to.
#include "core/identify/initial_state.hpp"

#include <Eigen/LU>
#include <catch2/catch.hpp>

#include "tests/support/systems.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

namespace {

/// f = xi_1^2: states of either sign may explain an output.
class SquareMap final : public StaticMap {
 public:
  explicit SquareMap(Index inputs) : StaticMap(inputs, 1, 1, 0) { W.setOnes(1, 1); }
  std::unique_ptr<StaticMap> clone() const override { return std::make_unique<SquareMap>(*this); }
  std::string name() const override { return "square"; }
  void initialise(ConstMatrixRef, ConstMatrixRef, Random&) override {}
  void basis(const double* xi, double* phi) const override { phi[0] = xi[0] * xi[0]; }
  void slopes(const double* xi, const double*, const double* w, double* dxi, double*) const override {
    std::fill(dxi, dxi + inputs(), 0.0);
    dxi[0] = 2 * w[0] * xi[0];
  }

 private:
  Json options() const override { return Json::object(); }
};

/// States of the free run on a long drive, with outputs that miss them by `noise`.
StateStatistics statistics_of(const NonlinearModel& model, double noise, Random& random) {
  const Matrix u = random.normal(model.linear.input_count(), 3000);
  const Vector x0 = Vector::Zero(model.order());
  Matrix y = free_run(model, u, x0).y;
  y += noise * random.normal(y.rows(), y.cols());
  return state_statistics(model, {{u, y, 0, x0}});
}

}  // namespace

TEST_CASE("the initial state of a known model is found from the first samples") {
  Random random = numbers(78);
  const NonlinearModel model = random_nonlinear(3, 2, 2, 2, random);
  const Matrix u = random.normal(2, 300);
  const Vector x0 = random.normal(3, 1);
  const Matrix y = free_run(model, u, x0).y;
  CHECK(relative_error(estimate_initial_state(model, u, y, 60), x0) < 1e-6);
  // Exact outputs leave nothing to what was known before.
  CHECK(relative_error(estimate_initial_state(model, u, y, 60, 0, statistics_of(model, 1e-7, random)), x0) < 1e-5);
}

TEST_CASE("statistics of states: those of the trajectories, over all records and without what is skipped") {
  Random random = numbers(610);
  const NonlinearModel model = random_nonlinear(3, 1, 2, 1, random);
  const Matrix u1 = random.normal(1, 700), u2 = random.normal(1, 300);
  const Vector x1 = random.normal(3, 1), x2 = random.normal(3, 1);
  const FreeRun a = free_run(model, u1, x1), b = free_run(model, u2, x2);
  const Matrix e1 = random.normal(2, 700), e2 = random.normal(2, 300);
  const StateStatistics found = state_statistics(model, {{u1, a.y + e1, 0, x1}, {u2, b.y + e2, 50, x2}});
  Matrix x(3, 950), e(2, 950);
  x << a.x, b.x.rightCols(250);
  e << e1, e2.rightCols(250);
  CHECK(relative_error(found.mean, x.rowwise().mean()) < 1e-12);
  CHECK(relative_error(found.covariance, covariance_of(x)) < 1e-10);
  CHECK(relative_error(found.residual_std, (e.rowwise().squaredNorm() / 950).cwiseSqrt()) < 1e-12);

  NonlinearModel growing = without_map(model.linear);
  growing.linear.A *= 1.2 / spectral_radius(growing.linear.A);
  CHECK_FALSE(state_statistics(growing, {{u1, a.y, 0, x1}}).known());
}

TEST_CASE("a linear model: the most probable state solves the normal equations with the covariance's inverse") {
  Random random = numbers(611);
  for (int draw = 0; draw < 5; ++draw) {
    const NonlinearModel model = without_map(random_linear(4, 1, 2, 0.9, random));
    const Matrix root = random.normal(4, 4), u = random.normal(1, 20), y = random.normal(2, 20);
    const StateStatistics known{random.normal(4, 1), root * root.transpose(), Vector(random.normal(2, 1).cwiseAbs())};
    const Index samples = 3 + draw, skip = 2;
    Matrix H = known.covariance.inverse();
    Vector g = H * known.mean;
    const Matrix at_zero = free_run(model, u, Vector::Zero(4)).y;
    const Matrix weight = known.residual_std.cwiseAbs2().cwiseInverse().asDiagonal();
    Matrix slope = model.linear.C;
    for (Index k = 0; k < skip + samples; ++k, slope = slope * model.linear.A) {
      if (k < skip) continue;
      H += slope.transpose() * weight * slope;
      g += slope.transpose() * weight * (y.col(k) - at_zero.col(k));
    }
    CHECK(relative_error(estimate_initial_state(model, u, y, samples, skip, known), H.inverse() * g) < 1e-8);
  }
}

TEST_CASE("few noisy samples: with what is known of the states the estimate is nearer to the truth") {
  Random random = numbers(612);
  double with = 0, without = 0;
  for (int draw = 0; draw < 40; ++draw) {
    const NonlinearModel model = random_nonlinear(4, 1, 1, 1, random);
    const StateStatistics known = statistics_of(model, 0.3, random);
    const Matrix u = random.normal(1, 400);
    const Vector x0 = free_run(model, random.normal(1, 200), Vector::Zero(4)).x.col(199);
    const Matrix y = free_run(model, u, x0).y + 0.3 * random.normal(1, 400);
    const auto error = [&](const Vector& x) { return (x - x0).squaredNorm() / known.covariance.trace(); };
    with += error(estimate_initial_state(model, u, y, 8, 0, known)) / 40;
    without += error(estimate_initial_state(model, u, y, 8)) / 40;
  }
  CHECK(with < 1);  // of the states' own variance
  CHECK(with < 0.5 * without);
}

TEST_CASE("states of either sign may explain the output: the estimate is as probable as the true state") {
  Random random = numbers(613);
  int found = 0;
  for (int draw = 0; draw < 30; ++draw) {
    NonlinearModel model;
    model.linear = random_linear(2, 1, 1, 0.95, random);
    model.linear.C *= 0.1;
    model.linear.D.setZero();
    model.Bt = Matrix::Zero(2, 1);
    model.Dt = Matrix::Ones(1, 1);
    model.map = std::make_shared<SquareMap>(3);
    const StateStatistics known = statistics_of(model, 0.05, random);
    const Vector x0 = free_run(model, random.normal(1, 200), Vector::Zero(2)).x.col(199);
    const Matrix u = random.normal(1, 60);
    const Matrix y = free_run(model, u, x0).y + 0.05 * random.normal(1, 60);
    const auto cost = [&](const Vector& x) {
      return (free_run(model, u, x).y - y).squaredNorm() / std::pow(known.residual_std(0), 2) +
             (x - known.mean).dot(known.covariance.inverse() * (x - known.mean));
    };
    found += cost(estimate_initial_state(model, u, y, 60, 0, known)) <= 1.001 * cost(x0);
  }
  CHECK(found >= 28);
}
