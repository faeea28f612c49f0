// Jacobians of groups that share some columns: what is stored gives what the whole matrix would.
#include "core/optimise/block_angular.hpp"

#include <catch2/catch.hpp>

#include "core/optimise/bounded_step.hpp"
#include "core/optimise/prior.hpp"
#include "tests/support/systems.hpp"
#include "variants/solver/levenberg_marquardt.hpp"
#include "variants/solver/secant_levenberg_marquardt.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

namespace {

constexpr Index kCommon = 3, kOwn = 2, kGroups = 4;

/// Rows of groups in no order, some groups twice.
BlockAngular some_layout() {
  return {kCommon, kOwn, kGroups, {{0, 7, 2}, {7, 5, 0}, {12, 3, 0}, {15, 9, 3}, {24, 0, 1}, {24, 6, 1}, {30, 4, 2}}};
}

Matrix whole_of(const BlockAngular& layout, const Matrix& stored) {
  Matrix whole = Matrix::Zero(stored.rows(), layout.columns());
  for (const RowBlock& block : layout.blocks())
    for (Index j = 0; j < layout.stored(); ++j)
      whole.col(layout.column(j, block.group)).segment(block.first, block.count) =
          stored.col(j).segment(block.first, block.count);
  return whole;
}

/// r_i = exp(a_i'x) - d_i, x the common parameters and those of the row's group.
struct Grouped final : ResidualProblem {
  BlockAngular blocks = some_layout();
  Matrix a;
  Vector d;
  mutable Index dense = 0;  // whole Jacobians that were asked for

  explicit Grouped(Random& random) : a(0.3 * random.normal(34, kCommon + kOwn)), d(34) {
    const Vector truth = 0.5 * random.normal(blocks.columns(), 1);
    d.setZero();
    Vector r(34);
    residual(truth, r);
    d = r + 0.05 * random.normal(34, 1);
  }
  Index parameters() const override { return blocks.columns(); }
  Index residuals() const override { return 34; }
  BlockAngular layout() const override { return blocks; }
  bool residual(ConstVectorRef theta, VectorRef r) const override {
    for (const RowBlock& block : blocks.blocks())
      r.segment(block.first, block.count) =
          (a.middleRows(block.first, block.count) * blocks.of_group(theta, block.group)).array().exp().matrix() -
          d.segment(block.first, block.count);
    return true;
  }
  bool stored_jacobian(ConstVectorRef theta, VectorRef r, MatrixRef J) const override {
    residual(theta, r);
    J = (r + d).asDiagonal() * a;
    return true;
  }
  bool jacobian(ConstVectorRef theta, VectorRef r, MatrixRef J) const override {
    ++dense;
    Matrix stored(34, blocks.stored());
    stored_jacobian(theta, r, stored);
    J = whole_of(blocks, stored);
    return true;
  }
};

}  // namespace

TEST_CASE("products with a stored block-angular matrix are those with the whole of it") {
  Random random = numbers(95);
  const BlockAngular layout = some_layout();
  CHECK(layout.blocks().size() == 5);  // rows 7 to 14 are one block, an empty one is none
  const Matrix J = random.normal(34, layout.stored()), A = whole_of(layout, J);
  const Vector r = random.normal(34, 1), s = random.normal(layout.columns(), 1);
  CHECK(relative_difference(layout.gram(J), A.transpose() * A) < 1e-14);
  CHECK(relative_difference(layout.lower_gram(J), Matrix((A.transpose() * A).triangularView<Eigen::Lower>())) < 1e-14);
  CHECK(relative_difference(layout.transposed_times(J, r), A.transpose() * r) < 1e-14);
  Vector left = r;
  layout.subtract_times(J, s, left);
  CHECK(relative_difference(left, r - A * s) < 1e-14);
}

TEST_CASE("a prior keeps the groups of its problem, and its stored Jacobian is its whole one") {
  Random random = numbers(96);
  const Grouped problem(random);
  const Vector theta = random.normal(problem.parameters(), 1), mean = random.normal(problem.parameters(), 1);
  const auto posterior = with_prior(problem, mean, random.normal(problem.parameters(), 1).cwiseAbs2());
  const BlockAngular layout = posterior->layout();
  Vector r(posterior->residuals()), r_stored = r;
  Matrix J(posterior->residuals(), posterior->parameters()), stored(posterior->residuals(), layout.stored());
  REQUIRE(posterior->jacobian(theta, r, J));
  REQUIRE(posterior->stored_jacobian(theta, r_stored, stored));
  CHECK(r == r_stored);
  CHECK(whole_of(layout, stored) == J);
}

TEST_CASE("solvers find the minimum of a problem in groups from what is stored alone") {
  Random random = numbers(97);
  const Grouped problem(random);
  const Vector zero = Vector::Zero(problem.parameters());
  const auto posterior = with_prior(problem, zero, Vector::Constant(problem.parameters(), 1e-2));
  const Solution exact = make_levenberg_marquardt({.relative_decrease = 1e-12})->minimise(*posterior, zero, 200);
  const Solution secant =
      make_secant_levenberg_marquardt({.relative_decrease = 1e-10})->minimise(*posterior, zero, 200);
  CHECK(exact.status == Status::ok);
  CHECK(secant.status == Status::ok);
  CHECK(problem.dense == 0);
  CHECK(relative_difference(secant.theta, exact.theta) < 1e-3);
  CHECK(secant.cost == Approx(exact.cost).epsilon(1e-6));
  CHECK(secant.evaluations.linearisations < exact.evaluations.linearisations);
  Vector gradient;
  Matrix H;
  double cost = 0;
  REQUIRE(posterior->normal_equations(exact.theta, cost, gradient, H));
  CHECK(gradient.norm() < 1e-4 * std::sqrt(2 * cost * H.diagonal().sum()));
}
