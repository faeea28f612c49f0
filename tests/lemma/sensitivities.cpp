// The model class of eq. (5): coordinates, folding, and the derivatives of its free run.
#include "core/model/sensitivities.hpp"

#include <catch2/catch.hpp>
#include <limits>

#include "core/data/metrics.hpp"
#include "core/identify/free_run_problem.hpp"
#include "tests/support/systems.hpp"
#include "variants/solver/levenberg_marquardt.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

namespace {

/// f = W [xi; xi_1^3; 1] without inner parameters: a map whose linear part is known.
class CubicMap final : public StaticMap {
 public:
  CubicMap(Index inputs, Index outputs) : StaticMap(inputs, outputs, inputs + 1, 0) {}
  std::unique_ptr<StaticMap> clone() const override { return std::make_unique<CubicMap>(*this); }
  std::string name() const override { return "cubic"; }
  void initialise(ConstMatrixRef, ConstMatrixRef, Random&) override {}
  void basis(const double* xi, double* phi) const override {
    std::copy(xi, xi + inputs(), phi);
    phi[inputs()] = xi[0] * xi[0] * xi[0];
  }
  void slopes(const double* xi, const double*, const double* w, double* dxi, double*) const override {
    std::copy(w, w + inputs(), dxi);
    dxi[0] += 3 * w[inputs()] * xi[0] * xi[0];
  }

 private:
  Json options() const override { return Json::object(); }
};

struct Case {
  NonlinearModel model;
  Matrix u;
  Vector x0;
};

Case make_case(std::uint64_t cell, Index samples = 300) {
  Random random = numbers(cell);
  Case c{random_nonlinear(3, 2, 2, 2, random), {}, {}};
  c.u = random.normal(2, samples);
  c.x0 = random.normal(3, 1);
  return c;
}

/// Stacked output of the free run at packed parameters theta.
Vector response(const Case& c, const Vector& theta) {
  NonlinearModel model = c.model;
  Vector x0;
  unpack(theta, model, x0);
  const FreeRun run = free_run(model, c.u, x0);
  REQUIRE(run.status == Status::ok);
  return run.y.reshaped();
}

}  // namespace

TEST_CASE("the free-run sensitivities equal central differences for every block of parameters") {
  const Case c = make_case(71);  // 300 samples: three blocks, the last one short
  const ParameterLayout at = layout_of(c.model);
  const Vector theta = pack(c.model, c.x0);
  const SensitivityRow row(at);
  Matrix J = Matrix::Zero(at.size(), 2 * c.u.cols()), y(2, c.u.cols());
  Index seen = 0;
  REQUIRE(free_run_sensitivities(c.model, c.u, c.x0, [&](Index first, Index count, const std::vector<Matrix>& rows) {
    CHECK(first == seen);  // consecutive, without gaps
    seen += count;
    for (Index i = 0; i < 2; ++i)
      for (Index k = 0; k < count; ++k) {
        const auto values = rows[static_cast<std::size_t>(i)].col(k);
        auto column = J.col(2 * (first + k) + i);
        column.head(at.dynamic()) = values.head(at.dynamic());
        for (Index j = 0; j < at.regressors(); ++j) column(at.direct(i, j)) = values(row.regressors + j);
        y(i, first + k) = values(row.output);
        CHECK(values.tail(row.size - row.output - 1).norm() == 0);
      }
  }));
  CHECK(seen == c.u.cols());
  CHECK(relative_difference(y, free_run(c.model, c.u, c.x0).y) < 1e-13);

  Matrix differences(at.size(), J.cols());
  const double step = 1e-5;
  for (Index i = 0; i < at.size(); ++i) {
    Vector up = theta, down = theta;
    up(i) += step;
    down(i) -= step;
    differences.row(i) = (response(c, up) - response(c, down)).transpose() / (2 * step);
  }
  const std::tuple<const char*, Index, Index> blocks[] = {
      {"A", at.A(), at.B()},       {"B", at.B(), at.Bt()},        {"Bt", at.Bt(), at.x0()},
      {"x0", at.x0(), at.theta()}, {"theta", at.theta(), at.C()}, {"C", at.C(), at.D()},
      {"D", at.D(), at.Dt()},      {"Dt", at.Dt(), at.y0()},      {"y0", at.y0(), at.size()}};
  for (const auto& [name, from, to] : blocks) {
    CAPTURE(name);
    REQUIRE(to > from);
    for (Index i = from; i < to; ++i) {
      CAPTURE(i - from);
      CHECK(differences.row(i).norm() > 0);
      // Step^2 times the third derivative, and round-off over the step.
      CHECK(relative_difference(J.row(i), differences.row(i)) < 1e-6);
    }
  }
}

TEST_CASE("packed parameters unpack to the same model, and an unpacked map is the model's own") {
  const Case c = make_case(72);
  const Vector theta = pack(c.model, c.x0);
  NonlinearModel copy = c.model;
  Vector x0;
  unpack(theta, copy, x0);
  CHECK(same_bits(pack(copy, x0), theta));
  CHECK(same_bits(free_run(copy, c.u, x0).y, free_run(c.model, c.u, c.x0).y));

  const Vector other = theta.array() + 0.01;
  unpack(other, copy, x0);
  CHECK(same_bits(pack(copy, x0), other));
  CHECK(same_bits(pack(c.model, c.x0), theta));  // the first holder's map was not touched
}

TEST_CASE("the normal equations of the free run are those of its residual and Jacobian, skipped samples left out") {
  const Case c = make_case(73);
  Random random = numbers(74);
  const Matrix y = random.normal(2, c.u.cols());
  const Vector weight = (Vector(2) << 0.5, 3).finished();
  const Vector theta = pack(c.model, c.x0);
  for (const Index skip : {0, 7, 128, 200}) {
    CAPTURE(skip);
    const auto problem = free_run_problem(c.model, c.u, y, weight, skip);
    REQUIRE(problem->residuals() == 2 * (c.u.cols() - skip));
    Vector r(problem->residuals()), r_alone(problem->residuals()), gradient;
    Matrix J(problem->residuals(), problem->parameters()), H;
    double cost = 0, cost_alone = 0;
    REQUIRE(problem->jacobian(theta, r, J));
    REQUIRE(problem->residual(theta, r_alone));
    REQUIRE(problem->normal_equations(theta, cost, gradient, H));
    REQUIRE(problem->cost(theta, cost_alone));
    const Matrix error = weight.cwiseInverse().asDiagonal() * (free_run(c.model, c.u, c.x0).y - y);
    CHECK(relative_difference(r_alone, error.rightCols(c.u.cols() - skip).reshaped()) < 1e-13);
    CHECK(relative_difference(r, r_alone) < 1e-12);
    CHECK(cost == Approx(0.5 * r.squaredNorm()).epsilon(1e-12));
    CHECK(cost_alone == Approx(cost).epsilon(1e-12));
    CHECK(relative_difference(gradient, J.transpose() * r) < 1e-11);
    const Matrix lower = H.triangularView<Eigen::Lower>(), gram = J.transpose() * J;
    CHECK(relative_difference(lower, gram.triangularView<Eigen::Lower>().toDenseMatrix()) < 1e-12);
  }
}

TEST_CASE("a free run that diverges stops at the guard, and every derivative of it answers outside the domain") {
  Case c = make_case(75);
  c.model.linear.A *= 1.5 / 0.7;
  const FreeRun run = free_run(c.model, c.u, c.x0);
  CHECK(run.status == Status::outside_domain);
  REQUIRE(run.stopped_at > 0);
  CHECK(run.stopped_at < c.u.cols());
  CHECK(run.x.cwiseAbs().maxCoeff() <= kStateGuard);
  CHECK(run.y.rightCols(c.u.cols() - run.stopped_at).norm() == 0);
  CHECK(run.y.col(run.stopped_at - 1).norm() > 0);
  CHECK_FALSE(free_run_sensitivities(c.model, c.u, c.x0, [](Index, Index, const std::vector<Matrix>&) {}));

  const Matrix nothing = Matrix::Zero(2, c.u.cols());
  const auto problem = free_run_problem(c.model, c.u, nothing, Vector::Ones(2), 0);
  const Vector theta = pack(c.model, c.x0);
  double cost = 0;
  Vector gradient;
  Matrix H;
  CHECK_FALSE(problem->cost(theta, cost));
  CHECK_FALSE(problem->normal_equations(theta, cost, gradient, H));
  const auto solver = make_levenberg_marquardt({});
  const Refinement refused = refine(c.model, c.x0, c.u, Matrix::Zero(2, c.u.cols()), Vector::Ones(2), 0, *solver, 5);
  CHECK(refused.solution.status == Status::outside_domain);
  CHECK(same_bits(pack(refused.model, refused.x0), theta));
}

TEST_CASE("a state that is not a number never passes the guard, in whichever place it stands") {
  Case c = make_case(75);
  c.model.linear.A = Matrix(c.model.linear.A.diagonal().asDiagonal());  // nothing spreads it to the other states
  c.model.map = nullptr;
  for (Index i = 0; i < 3; ++i) {
    Vector x0 = c.x0;
    x0(i) = std::numeric_limits<double>::quiet_NaN();
    const FreeRun run = free_run(c.model, c.u, x0);
    CHECK(run.status == Status::outside_domain);
    CHECK(run.stopped_at == 0);
    CHECK_FALSE(free_run_sensitivities(c.model, c.u, x0, [](Index, Index, const std::vector<Matrix>&) {}));
  }
}

TEST_CASE("Sec. 2.6: the joint refinement returns to the response of the true model from a disturbed one") {
  Case c = make_case(76, 600);
  const Matrix y = free_run(c.model, c.u, c.x0).y;
  NonlinearModel start = c.model;
  Vector x0;
  Random random = numbers(77);
  const Vector theta = pack(c.model, c.x0);
  unpack(theta + 0.01 * random.normal(theta.size(), 1), start, x0);
  const double before = relative_difference(free_run(start, c.u, x0).y, y);
  const Refinement fit = refine(start, x0, c.u, y, Vector::Ones(2), 0, *make_levenberg_marquardt({}), 50);
  CHECK(before > 1e-3);
  CHECK(relative_difference(free_run(fit.model, c.u, fit.x0).y, y) < 1e-5 * before);
}

TEST_CASE("a change of state coordinates leaves response, Markov parameters and poles as they were") {
  Random random = numbers(79);
  LinearModel model = random_linear(4, 2, 3, 0.9, random);
  model.y0 = random.normal(3, 1);
  const Matrix T = random.normal(4, 4) + 3 * Matrix::Identity(4, 4), u = random.normal(2, 100);
  const Vector x0 = random.normal(4, 1);
  const LinearModel moved = similarity_transform(model, T);
  const Response here = simulate(model, u, x0), there = simulate(moved, u, T * x0);
  CHECK(relative_difference(there.y, here.y) < 1e-12);
  CHECK(relative_difference(there.x, T * here.x) < 1e-12);  // x_new = T x, not its inverse
  CHECK(relative_difference(markov_parameters(moved, 10), markov_parameters(model, 10)) < 1e-12);
  CHECK(spectral_radius(moved.A) == Approx(0.9));
}

TEST_CASE("eq. (5): a linear part of the map may stand in the map or in A, B, C, D, the response is the same") {
  Random random = numbers(80);
  NonlinearModel in_map;
  in_map.linear = random_linear(3, 2, 2, 0.6, random);
  in_map.Bt = 0.2 * random.normal(3, 2);
  in_map.Dt = 0.2 * random.normal(2, 2);
  const Matrix L = 0.3 * random.normal(2, 5);
  const auto map = std::make_shared<CubicMap>(5, 2);
  map->W.leftCols(5) = L;
  map->W.col(5) << -0.05, 0.02;
  in_map.map = map;

  NonlinearModel in_matrices = in_map;
  const auto bare = std::make_shared<CubicMap>(*map);
  bare->W.leftCols(5).setZero();
  in_matrices.map = bare;
  const Matrix u = 0.5 * random.normal(2, 200);
  const Vector x0 = 0.5 * random.normal(3, 1);
  const FreeRun expected = free_run(in_map, u, x0);
  REQUIRE(expected.status == Status::ok);
  CHECK(relative_difference(free_run(in_matrices, u, x0).y, expected.y) > 1e-2);
  fold_linear_part(in_matrices, L);
  CHECK(relative_difference(free_run(in_matrices, u, x0).y, expected.y) < 1e-12);
}

TEST_CASE("a stable A is left alone bit for bit, an unstable one keeps its stable poles and reflects the others") {
  Random random = numbers(81);
  const Matrix stable = random_dynamics(5, 0.999, random);
  CHECK(same_bits(stabilised(stable), stable));

  Matrix modes = Matrix::Zero(4, 4);
  modes.diagonal() << 0.5, -1.25, 0, 0;
  modes.bottomRightCorner(2, 2) << 0.9, 0.8, -0.8, 0.9;  // 0.9 +- 0.8i, of modulus 1.204
  const Matrix T = random.normal(4, 4);
  const Matrix A = solve(T, modes * T), B = stabilised(A);
  CHECK(spectral_radius(A) == Approx(1.25));
  const ComplexVector poles = eigenvalues(B);
  const double squared = 0.81 + 0.64;
  for (const std::complex<double> expected :
       {std::complex<double>{0.5, 0}, {-0.8, 0}, {0.9 / squared, 0.8 / squared}, {0.9 / squared, -0.8 / squared}})
    CHECK((poles.array() - expected).abs().minCoeff() < 1e-10);
  // A pole on the circle, or so close outside that its reflection is no better, goes to the limit.
  CHECK(spectral_radius(stabilised(Matrix::Identity(1, 1), 0.99)) == Approx(0.99));
}

TEST_CASE("a sample at a limit counts where the free run is inside, and the derivatives follow") {
  for (std::uint64_t draw = 0; draw < 5; ++draw) {
    CAPTURE(draw);
    Case c = make_case(4110 + draw);
    const Matrix whole = free_run(c.model, c.u, c.x0).y;
    constexpr double infinity = std::numeric_limits<double>::infinity();
    c.model.limits = {Vector::Constant(2, -infinity), Vector(0.7 * rms(whole))};
    c.model.limits.low(1) = -0.5 * rms(whole)(1);
    CHECK(free_run(c.model, c.u, c.x0).y == [&] {
      Matrix y = whole;
      cut_off(c.model.limits, y);
      return y;
    }());
    Random random = numbers(4120 + draw);
    Matrix y = whole + 0.05 * random.normal(2, c.u.cols());
    cut_off(c.model.limits, y);
    const auto problem = free_run_problem(c.model, c.u, y, Vector::Ones(2), 0);
    const Vector theta = pack(c.model, c.x0);
    Vector r(problem->residuals()), same(problem->residuals());
    Matrix J(problem->residuals(), problem->parameters());
    REQUIRE(problem->residual(theta, r));
    REQUIRE(problem->jacobian(theta, same, J));
    CHECK(relative_error(same, r) < 1e-12);
    Index excused = 0;
    for (Index k = 0; k < c.u.cols(); ++k)
      for (Index i = 0; i < 2; ++i) {
        const bool beyond = (y(i, k) == c.model.limits.high(i) && whole(i, k) > y(i, k)) ||
                            (y(i, k) == c.model.limits.low(i) && whole(i, k) < y(i, k));
        excused += beyond;
        CHECK(r(2 * k + i) == Approx(beyond ? 0 : whole(i, k) - y(i, k)).margin(1e-12));
      }
    CHECK(excused > c.u.cols() / 10);
    double cost = 0;
    Vector gradient;
    Matrix H;
    REQUIRE(problem->normal_equations(theta, cost, gradient, H));
    CHECK(cost == Approx(0.5 * r.squaredNorm()));
    CHECK(relative_error(gradient, J.transpose() * r) < 1e-9);
    // The cost has a derivative where the run crosses a limit, too.
    const Vector direction = random.normal(theta.size(), 1).normalized();
    double ahead = 0, behind = 0;
    const double step = 1e-6;
    REQUIRE(problem->cost(theta + step * direction, ahead));
    REQUIRE(problem->cost(theta - step * direction, behind));
    CHECK((ahead - behind) / (2 * step) == Approx(gradient.dot(direction)).epsilon(1e-4).margin(1e-5));
  }
}
