// The input matrix of the nonlinearity by eq. (17), and the variable projections behind it and behind the static map.
#include "core/identify/direction.hpp"

#include <catch2/catch.hpp>

#include "core/identify/map_fit.hpp"
#include "tests/support/systems.hpp"
#include "variants/solver/levenberg_marquardt.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

namespace {

constexpr double kSampleTime = 0.005;

/// Options that use the whole band: the test's f is white.
DirectionOptions whole_band(Index count, bool direct_term) {
  DirectionOptions options;
  options.count = count;
  options.direct_term = direct_term;
  options.cutoff_hz = 0.5 / kSampleTime;
  return options;
}

Matrix stacked_direction(const LinearModel& system, bool direct_term) {
  Matrix all(system.order() + (direct_term ? system.output_count() : 0), system.input_count());
  if (direct_term)
    all << system.B, system.D;
  else
    all = system.B;
  return all;
}

/// Smallest cosine of the principal angles between two column spaces.
double worst_cosine(const Matrix& a, const Matrix& b) {
  const Matrix Qa = svd(a).U, Qb = svd(b).U;
  return svd(Qa.transpose() * Qb).s.minCoeff();
}

double relative_residual(const ResidualProblem& problem, const Matrix& direction) {
  Vector r(problem.residuals());
  REQUIRE(problem.residual(direction.reshaped(), r));
  return r.norm();
}

void check_gradient(const ResidualProblem& problem, const Vector& theta) {
  double cost = 0;
  Vector gradient;
  Matrix gauss_newton;
  REQUIRE(problem.normal_equations(theta, cost, gradient, gauss_newton));
  const Vector differences = central_differences(
      [&](const Vector& at) {
        double value = 0;
        REQUIRE(problem.cost(at, value));
        return value;
      },
      theta);
  // Differences of step h are right to h^2 and round-off / h.
  CHECK((gradient - differences).norm() < 1e-7 * (gradient.norm() + cost));
  CHECK(gradient.norm() > 1e-5 * cost);  // not at a stationary point, where any Jacobian would do
}

}  // namespace

TEST_CASE("eq. (17): [Bt, Dt] comes back from the residual of a rich f, up to sign and rotation", "[slow]") {
  const auto solver = make_levenberg_marquardt({});
  for (const auto& [n, p, q, direct] :
       {std::tuple<Index, Index, Index, bool>{4, 3, 1, true}, {4, 2, 1, false}, {3, 2, 1, true}, {4, 4, 2, true}}) {
    CAPTURE(n, p, q, direct);
    Random random = numbers(61);
    LinearModel system = random_linear(n, q, p, 0.7, random);
    if (!direct) system.D.setZero();
    const Matrix z = simulate(system, random.normal(q, 8000), Vector::Zero(n)).y;
    const Direction found =
        estimate_direction(system.A, system.C, z, kSampleTime, whole_band(q, direct), *solver, random);
    REQUIRE(found.status == Status::ok);
    CHECK(found.residual <
          5e-3);  // what the window leaves of the memory of the plant: its length over that of the record
    CHECK(found.agreeing >= 1);
    Matrix all(direct ? n + p : n, q);
    if (direct)
      all << found.Bt, found.Dt;
    else
      all = found.Bt;
    CHECK((all.transpose() * all - Matrix::Identity(q, q)).norm() < 1e-12);
    CHECK(worst_cosine(all, stacked_direction(system, direct)) > 0.9999);
    if (!direct) CHECK(found.Dt.norm() == 0);
    CHECK(found.channel_residual.size() == p);
  }
}

TEST_CASE("eq. (17): the residual vanishes at the true direction only") {
  Random random = numbers(62);
  const LinearModel system = random_linear(4, 1, 3, 0.7, random);
  const Matrix z = simulate(system, random.normal(1, 8000), Vector::Zero(4)).y;
  const auto problem = direction_problem(system.A, system.C, z, kSampleTime, whole_band(1, true));
  const Matrix truth = stacked_direction(system, true);
  const double at_truth = relative_residual(*problem, truth);
  CHECK(at_truth < 5e-3);
  // The length and sign of the direction belong to f.
  CHECK(relative_residual(*problem, -3 * truth) == Approx(at_truth).epsilon(1e-9));
  for (const double size : {0.1, 0.3, 1.0}) {
    const Matrix change = random.normal(truth.rows(), 1);
    CHECK(relative_residual(*problem, truth + size * truth.norm() / change.norm() * change) > 10 * at_truth);
  }
}

TEST_CASE("eq. (17): with two nonlinearities any basis of their plane gives the same residual") {
  Random random = numbers(63);
  const LinearModel system = random_linear(4, 2, 3, 0.7, random);
  const Matrix z = simulate(system, random.normal(2, 3000), Vector::Zero(4)).y + 0.1 * random.normal(3, 3000);
  const auto problem = direction_problem(system.A, system.C, z, kSampleTime, whole_band(2, true));
  const Matrix some = random.normal(7, 2), mixed = some * random.normal(2, 2);
  CHECK(relative_residual(*problem, mixed) == Approx(relative_residual(*problem, some)).epsilon(1e-9));
}

TEST_CASE("Sec. 2.7, assumption 2: as many nonlinearities as outputs are refused, and so is a zero residual") {
  Random random = numbers(64);
  const LinearModel system = random_linear(4, 1, 2, 0.7, random);
  const auto solver = make_levenberg_marquardt({});
  const Matrix z = random.normal(2, 500);
  for (const Index q : {2, 3}) {
    const Direction refused =
        estimate_direction(system.A, system.C, z, kSampleTime, whole_band(q, true), *solver, random);
    CHECK(refused.status == Status::rank_deficient);
    CHECK_FALSE(refused.message.empty());
  }
  const Direction nothing =
      estimate_direction(system.A, system.C, 0 * z, kSampleTime, whole_band(1, true), *solver, random);
  CHECK(nothing.status == Status::failed);
  CHECK_FALSE(nothing.message.empty());
}

TEST_CASE("the gradient of the direction's variable projection is that of its cost") {
  Random random = numbers(65);
  for (const auto& [q, direct] : {std::pair<Index, bool>{1, true}, {2, true}, {1, false}}) {
    const LinearModel system = random_linear(3, 1, 3, 0.8, random);
    const Matrix z = random.normal(3, 200);
    const auto problem = direction_problem(system.A, system.C, z, kSampleTime, whole_band(q, direct));
    REQUIRE(problem->parameters() == (direct ? 6 : 3) * q);
    check_gradient(*problem, random.normal(problem->parameters(), 1));
  }
}

TEST_CASE("the gradient of the static map's variable projection is that of its cost") {
  Random random = numbers(66);
  for (const Index q : {1, 2}) {
    const Matrix xi = random.normal(3, 150), f = random.normal(q, 150);
    const auto map = make_mlp(3, q, {.hidden_units = 2});
    start_anywhere(*map, random);
    const auto problem = map_problem(*map, xi, f);
    REQUIRE(problem->parameters() == 8);
    check_gradient(*problem, map->alpha);
    // cost() reads the triangle of a QR alone, residual() projects: two ways to one number.
    Vector r(problem->residuals());
    double cost = 0;
    REQUIRE(problem->residual(map->alpha, r));
    REQUIRE(problem->cost(map->alpha, cost));
    CHECK(cost == Approx(0.5 * r.squaredNorm()).epsilon(1e-10));
  }
}

TEST_CASE(
    "Sec. 2.6, eq. (4): a map of the family is found again, split into a part uncorrelated with xi and a linear one") {
  Random random = numbers(67);
  const auto truth = make_mlp(2, 1, {.hidden_units = 1});
  truth->alpha << 1.2, -0.7, 0.4;
  truth->W(0, 0) = 2;
  const Index N = 600;
  const Matrix xi = random.normal(2, N);
  Vector phi(1);
  const auto values = [&](const StaticMap& map) {
    Matrix f(1, N);
    for (Index k = 0; k < N; ++k) map.value(xi.col(k).data(), &f(0, k), phi.data());
    return f;
  };
  const Matrix f = values(*truth) + (Matrix(1, 2) << 0.5, -0.3).finished() * xi;
  const auto prototype = make_mlp(2, 1, {.hidden_units = 1});
  const MapFit fit = fit_static_map(*prototype, xi, f, {}, *make_levenberg_marquardt({}), random);
  REQUIRE(fit.status == Status::ok);
  CHECK(fit.residual < 1e-6);
  const Matrix nonlinear = values(*fit.map), rest = f - nonlinear - fit.linear * xi;
  CHECK(rest.norm() < 1e-5 * f.norm());  // the constant included
  const Matrix varying = nonlinear.array() - nonlinear.mean(), centred = xi.colwise() - xi.rowwise().mean().eval();
  CHECK((varying * centred.transpose()).norm() < 1e-10 * nonlinear.norm() * xi.norm());
  CHECK(nonlinear.norm() > 0.05 * f.norm());
}
