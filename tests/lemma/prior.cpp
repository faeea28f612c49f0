// The Gaussian prior on a least-squares problem: its minimum is the posterior mode, its derivatives are its cost's.
#include <Eigen/Cholesky>
#include <catch2/catch.hpp>

#include "core/optimise/prior.hpp"
#include "tests/support/systems.hpp"
#include "variants/nonlinearity/mlp.hpp"
#include "variants/solver/levenberg_marquardt.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

namespace {

/// r = M theta - d.
struct Linear final : ResidualProblem {
  Matrix M;
  Vector d;
  Index parameters() const override { return M.cols(); }
  Index residuals() const override { return M.rows(); }
  bool residual(ConstVectorRef theta, VectorRef r) const override {
    r = M * theta - d;
    return theta(0) < 100;
  }
  bool jacobian(ConstVectorRef theta, VectorRef r, MatrixRef J) const override {
    J = M;
    return residual(theta, r);
  }
};

Linear some_problem(Random& random) {
  Linear problem;
  problem.M = random.normal(20, 4);
  problem.d = random.normal(20, 1);
  return problem;
}

}  // namespace

TEST_CASE("with a prior, a linear problem's minimum is the posterior mode (M'M + P)^-1 (M'd + P m)") {
  Random random = numbers(91);
  const Linear problem = some_problem(random);
  const Vector mean = random.normal(4, 1), precision = (Vector(4) << 0, 0.3, 5, 1e6).finished();
  const auto posterior = with_prior(problem, mean, precision);
  const Matrix H = problem.M.transpose() * problem.M + Matrix(precision.asDiagonal());
  const Vector expected = H.ldlt().solve(problem.M.transpose() * problem.d + precision.cwiseProduct(mean));
  const Solution found = make_levenberg_marquardt({})->minimise(*posterior, Vector::Zero(4), 200);
  CHECK(relative_difference(found.theta, expected) < 1e-7);
  CHECK(found.theta(3) == Approx(mean(3)).epsilon(1e-4));  // held by its precision
}

TEST_CASE("a prior's cost, gradient and curvature are those of its residuals, and its domain is the problem's") {
  Random random = numbers(92);
  const Linear problem = some_problem(random);
  const Vector mean = random.normal(4, 1), precision = random.normal(4, 1).cwiseAbs2(), theta = random.normal(4, 1);
  const auto posterior = with_prior(problem, mean, precision);
  REQUIRE(posterior->residuals() == 24);
  Vector r(24), r_alone(24), gradient;
  Matrix J(24, 4), H;
  double cost = 0, cost_alone = 0;
  REQUIRE(posterior->jacobian(theta, r, J));
  REQUIRE(posterior->residual(theta, r_alone));
  REQUIRE(posterior->cost(theta, cost_alone));
  REQUIRE(posterior->normal_equations(theta, cost, gradient, H));
  CHECK(relative_difference(r, r_alone) == 0);
  CHECK(cost == Approx(0.5 * r.squaredNorm()));
  CHECK(cost_alone == Approx(cost));
  CHECK(relative_difference(gradient, J.transpose() * r) < 1e-13);
  CHECK(relative_difference(H.triangularView<Eigen::Lower>().toDenseMatrix(),
                            (J.transpose() * J).triangularView<Eigen::Lower>().toDenseMatrix()) < 1e-13);
  CHECK(residual_variance(problem, theta) == Approx((problem.M * theta - problem.d).squaredNorm() / 20));
  const Vector outside = Vector::Constant(4, 200);
  CHECK_FALSE(posterior->cost(outside, cost));
  CHECK_FALSE(posterior->normal_equations(outside, cost, gradient, H));
  CHECK(residual_variance(problem, outside) == 0);
}

TEST_CASE("an MLP's prior holds the slopes of its units and leaves offsets and gains free") {
  const auto map = make_mlp(3, 1, {.hidden_units = 2, .slope_std = 4});
  const Vector precision = map->precision();
  REQUIRE(precision.size() == 11);
  for (Index i = 0; i < 8; ++i) CHECK(precision(i) == Approx(i % 4 == 3 ? 0 : 1.0 / 16));
  CHECK(precision.tail(3).norm() == 0);
}
