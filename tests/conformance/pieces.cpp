// What every swappable piece owes its callers: the same bits for the same call, and a status instead of a crash.
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "core/optimise/bounded_step.hpp"
#include "tests/support/pieces.hpp"
#include "tests/support/systems.hpp"
#include "variants/inversion/sdi.hpp"
#include "variants/solver/levenberg_marquardt.hpp"
#include "variants/subspace/pi_moesp.hpp"
#include "variants/table.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// The pieces alone, with default options.
template <class Piece>
std::vector<Piece> all_of(const std::vector<Entry<Piece>>& table) {
  std::vector<Piece> all;
  for (const Named<Piece>& named : pieces_of(table)) all.push_back(named.piece);
  return all;
}

std::vector<SubspacePiece> estimators() { return all_of(subspace_table()); }

/// Every reconstructor, and the one of the paper with each of its read-outs.
std::vector<InversionPiece> reconstructors() {
  std::vector<InversionPiece> all = all_of(inversion_table());
  for (const char* read_out : {"predictor", "filtered", "fixed_lag", "smoothed"})
    all.push_back(make_sdi({.read_out = read_out}));
  return all;
}

/// Rosenbrock's valley: r = (10 (b - a^2), 1 - a), minimum 0 at (1, 1).
class Rosenbrock final : public ResidualProblem {
 public:
  Index parameters() const override { return 2; }
  Index residuals() const override { return 2; }
  bool residual(ConstVectorRef x, VectorRef r) const override {
    r << 10 * (x(1) - x(0) * x(0)), 1 - x(0);
    return x(0) < limit;
  }
  bool jacobian(ConstVectorRef x, VectorRef r, MatrixRef J) const override {
    J << -20 * x(0), 10, -1, 0;
    return residual(x, r);
  }
  Box box() const override { return box_of_theta; }
  double limit = std::numeric_limits<double>::infinity();  // the domain ends here
  Box box_of_theta;
};

/// r = atan(x), with derivatives above an edge only: a full step from beyond 1 lands far on the other side of 0.
class ArcTangent final : public ResidualProblem {
 public:
  explicit ArcTangent(double edge) : edge_(edge) {}
  Index parameters() const override { return 1; }
  Index residuals() const override { return 1; }
  bool residual(ConstVectorRef x, VectorRef r) const override {
    r(0) = std::atan(x(0));
    return true;
  }
  bool jacobian(ConstVectorRef x, VectorRef r, MatrixRef J) const override {
    J(0, 0) = 1 / (1 + x(0) * x(0));
    return residual(x, r) && x(0) > edge_;
  }

 private:
  double edge_;
};

class LinearResidual final : public ResidualProblem {
 public:
  LinearResidual(Matrix A, Vector b, Box box = {}) : A_(std::move(A)), b_(std::move(b)), box_(std::move(box)) {}
  Box box() const override { return box_; }
  Index parameters() const override { return A_.cols(); }
  Index residuals() const override { return A_.rows(); }
  bool residual(ConstVectorRef x, VectorRef r) const override {
    r = A_ * x - b_;
    return true;
  }
  bool jacobian(ConstVectorRef x, VectorRef r, MatrixRef J) const override {
    J = A_;
    return residual(x, r);
  }

 private:
  Matrix A_;
  Vector b_;
  Box box_;
};

/// Karush, Kuhn & Tucker for 1/2 ||A x - b||^2 in a box: inside, and the gradient 0 but where it presses on a bound.
void check_minimum(const Matrix& A, const Vector& b, const Vector& x, const Box& box) {
  CHECK((x - box.lower).minCoeff() >= 0);
  CHECK((box.upper - x).minCoeff() >= 0);
  const Vector gradient = A.transpose() * (A * x - b);
  const double small = 1e-4 * (A.transpose() * b).norm();
  for (Index i = 0; i < x.size(); ++i) {
    const bool low = x(i) - box.lower(i) < 1e-9, high = box.upper(i) - x(i) < 1e-9;
    CAPTURE(i, x(i), gradient(i));
    CHECK((std::abs(gradient(i)) < small || (low && gradient(i) > 0) || (high && gradient(i) < 0)));
  }
}

const Vector kValleyStart = (Vector(2) << -1.2, 1).finished();

}  // namespace

TEST_CASE("subspace estimators: the same record gives the same bits") {
  Random random = numbers(91);
  const LinearModel truth = random_linear(3, 2, 2, 0.9, random);
  const Matrix u = random.normal(2, 500), y = simulate(truth, u, Vector::Zero(3)).y + 0.1 * random.normal(2, 500);
  for (const auto& piece : estimators()) {
    const LinearEstimate one = piece->identify(u, y, 3), two = piece->identify(u, y, 3);
    REQUIRE(one.status == Status::ok);
    for (const auto member : {&LinearModel::A, &LinearModel::B, &LinearModel::C, &LinearModel::D})
      CHECK(same_bits(one.model.*member, two.model.*member));
    CHECK(same_bits(one.x0, two.x0));
    CHECK(one.spectral_radius == spectral_radius(one.model.A));
  }
}

TEST_CASE("subspace estimators: NaN, constant or silent input, and too short a record give a status and a reason") {
  Random random = numbers(92);
  const LinearModel truth = random_linear(3, 1, 2, 0.9, random);
  const Matrix u = random.normal(1, 500), y = simulate(truth, u, Vector::Zero(3)).y;
  Matrix u_broken = u, y_broken = y;
  u_broken(0, 250) = kNaN;
  y_broken(1, 250) = kNaN;
  const Matrix constant = Matrix::Constant(1, 500, 2), silent = Matrix::Zero(1, 500);
  Matrix sine(1, 500);
  for (Index k = 0; k < 500; ++k) sine(0, k) = std::sin(0.3 * static_cast<double>(k)) + 0.2;
  const std::tuple<const char*, Matrix, Matrix> records[] = {
      {"NaN in u", u_broken, y},
      {"NaN in y", u, y_broken},
      {"constant u", constant, simulate(truth, constant, Vector::Ones(3)).y},
      {"silent u", silent, simulate(truth, silent, Vector::Ones(3)).y},
      {"silent u and y", silent, Matrix::Zero(2, 500)},
      {"silent y", u, Matrix::Zero(2, 500)},
      {"constant u, noise in y", constant / 7, random.normal(2, 500)},
      {"sine u", sine, simulate(truth, sine, Vector::Ones(3)).y},
      {"sine u, noise in y", sine, random.normal(2, 500)},
      {"two equal inputs", u.replicate(2, 1), y},
      {"short", u.leftCols(20), y.leftCols(20)},
      {"one sample", u.leftCols(1), y.leftCols(1)},
      {"empty", u.leftCols(0), y.leftCols(0)}};
  for (const auto& piece : estimators())
    for (const auto& [what, input, output] : records)
      for (const Index order : {0, 3}) {
        CAPTURE(piece->name(), what, order);
        const LinearEstimate estimate = piece->identify(input, output, order);
        CHECK(estimate.status != Status::ok);
        CHECK_FALSE(estimate.message.empty());
      }
}

TEST_CASE("subspace estimators: an order beyond what the block rows can carry is refused with the numbers") {
  Random random = numbers(93);
  const auto piece = make_pi_moesp({.block_rows = 8});
  const LinearEstimate estimate = piece->identify(random.normal(1, 500), random.normal(1, 500), 9);
  CHECK(estimate.status == Status::rank_deficient);
  CHECK_THAT(estimate.message, Catch::Contains("9") && Catch::Contains("8"));
}

TEST_CASE("input reconstructors: the same residual gives the same bits, and NaN gives a status and a reason") {
  Random random = numbers(94);
  const LinearModel system = random_linear(3, 1, 2, 0.9, random);
  const Matrix z = simulate(system, random.normal(1, 300), Vector::Zero(3)).y;
  Matrix broken = z;
  broken(0, 100) = kNaN;
  for (const auto& piece : reconstructors()) {
    CAPTURE(piece->name());
    const auto run = [&](const Matrix& signal, const Vector& noise) {
      return piece->reconstruct(system.A, system.C, system.B, system.D, signal, noise);
    };
    const Reconstruction one = run(z, Vector::Ones(2)), two = run(z, Vector::Ones(2));
    REQUIRE(one.status == Status::ok);
    CHECK(one.f.rows() == 1);
    CHECK(one.f.cols() == z.cols());
    CHECK(one.first >= 0);
    CHECK(one.first < one.last);
    CHECK(one.last <= z.cols());
    CHECK(same_bits(one.f, two.f));
    CHECK(one.log_likelihood == two.log_likelihood);
    // Only the ratio of the noise levels matters.
    CHECK(relative_error(run(z, 7 * Vector::Ones(2)).f, one.f) < 1e-9);

    for (const Reconstruction& refused : {run(broken, Vector::Ones(2)), run(z, Vector::Constant(2, kNaN))}) {
      CHECK(refused.status != Status::ok);
      CHECK_FALSE(refused.message.empty());
    }
    Matrix unseen = Matrix::Zero(3, 1);
    const Reconstruction blind = piece->reconstruct(system.A, system.C, unseen, Matrix::Zero(2, 1), z, Vector::Ones(2));
    CHECK(blind.status != Status::ok);
    CHECK_FALSE(blind.message.empty());
    const Reconstruction brief = run(z.leftCols(1), Vector::Ones(2));
    CHECK((brief.status != Status::ok || all_finite(brief.f)));
  }
}

TEST_CASE("static maps: the Jacobians equal central differences, and a clone is independent") {
  Random random = numbers(95);
  for (const MapFactory& make : all_of(nonlinearity_table()))
    for (const Index d : {1, 4}) {
      const auto map = make(d, 2);
      start_anywhere(*map, random);
      const Index h = map->features(), inner = map->inner_parameters();
      map->W = random.normal(2, h);
      map->b = random.normal(2, 1);
      map->L = random.normal(2, d);
      CAPTURE(map->name(), d);
      REQUIRE(map->inputs() == d);
      REQUIRE(map->outputs() == 2);
      const Vector xi = random.normal(d, 1), theta = map->theta();
      REQUIRE(theta.size() == inner + 2 * h + 2);
      Vector phi(h), plain(h), scratch(h);
      Matrix dphi_dxi(d, h), dphi_dalpha(inner, h);
      map->basis(xi.data(), plain.data());
      for (Index i = 0; i < h; ++i)
        map->slopes(xi.data(), plain.data(), Vector(Vector::Unit(h, i)).data(), dphi_dxi.col(i).data(),
                    dphi_dalpha.col(i).data());
      const Vector w = random.normal(h, 1);
      Vector dxi(d), dalpha(inner);
      map->slopes(xi.data(), plain.data(), w.data(), dxi.data(), dalpha.data());
      CHECK((dxi - dphi_dxi * w).norm() < 1e-13 * w.norm());
      CHECK((dalpha - dphi_dalpha * w).norm() < 1e-13 * w.norm());
      const auto moved = map->clone();
      for (Index i = 0; i < h; ++i) {
        const auto by_input = [&](const Vector& at) { return map->basis(at.data(), scratch.data()), scratch(i); };
        const auto by_inner = [&](const Vector& at) {
          moved->alpha = at;
          return moved->basis(xi.data(), scratch.data()), scratch(i);
        };
        CHECK((dphi_dxi.col(i) - central_differences(by_input, xi)).norm() < 1e-8 * (1 + dphi_dxi.col(i).norm()));
        CHECK((dphi_dalpha.col(i) - central_differences(by_inner, map->alpha)).norm() <
              1e-8 * (1 + dphi_dalpha.col(i).norm()));
      }
      const auto copy = map->clone();
      copy->set_theta(2 * theta);
      CHECK(same_bits(map->theta(), theta));
      CHECK(same_bits(copy->theta(), 2 * theta));
      CHECK_THROWS_AS(copy->set_theta(theta.head(1)), std::invalid_argument);

      Vector f(2), f_restored(2);
      map->value(xi.data(), f.data(), phi.data());
      CHECK((f - map->W * plain - map->b - map->L * xi).norm() < 1e-13 * f.norm());
      const Json file = parse_json(map->to_json().dump(), "model.json");
      const auto restored = restore_map(JsonCursor::from(file, "model.json"), d, 2);
      restored->value(xi.data(), f_restored.data(), phi.data());
      CHECK(same_bits(f_restored, f));
    }
}

TEST_CASE("solvers: Rosenbrock's valley is followed to its end, the same way each time") {
  for (const SolverPiece& solver : all_of(solver_table())) {
    const Solution found = solver->minimise(Rosenbrock{}, kValleyStart, 200),
                   again = solver->minimise(Rosenbrock{}, kValleyStart, 200);
    CHECK(found.status == Status::ok);
    CHECK((found.theta - Vector::Ones(2)).norm() < 1e-6);
    CHECK(found.cost < 1e-12);
    CHECK(same_bits(found.theta, again.theta));
    CHECK(found.iterations == again.iterations);
  }
}

TEST_CASE("solvers: in a box they find the minimum there, on its faces and corners and inside") {
  Random random = numbers(97);
  for (int trial = 0; trial < 30; ++trial) {
    const Matrix A = random.normal(12, 5);
    const Vector b = 3 * random.normal(12, 1);
    Box box{-random.normal(5, 1).cwiseAbs(), 0.3 * random.normal(5, 1).cwiseAbs()};
    if (trial % 3 == 0) box.lower(2) = -std::numeric_limits<double>::infinity();
    check_minimum(A, b, bounded_least_squares(A, b, box), box);
    const Vector start = trial % 2 == 0 ? Vector(Vector::Zero(5)) : box.upper;
    for (const SolverPiece& solver : all_of(solver_table())) {
      CAPTURE(solver->name(), trial);
      const Solution found = solver->minimise(LinearResidual(A, b, box), start, 200);
      CAPTURE(found.message, found.iterations);
      check_minimum(A, b, found.theta, box);
    }
  }
  Rosenbrock valley;
  valley.box_of_theta = {Vector::Constant(2, -2), (Vector(2) << 0.5, 2).finished()};
  for (const SolverPiece& solver : all_of(solver_table())) {
    const Solution found = solver->minimise(valley, kValleyStart, 200);
    CHECK(found.status == Status::ok);
    CHECK(found.theta(0) == 0.5);
    CHECK(found.theta(1) == Approx(0.25).epsilon(1e-6));
  }
}

TEST_CASE("Levenberg-Marquardt: without damping one step solves a linear problem, redundant parameters or not") {
  Random random = numbers(96);
  const Matrix A = random.normal(20, 4);
  const Vector b = random.normal(20, 1);
  Matrix redundant(20, 6);
  redundant << A, A.col(0) + A.col(1), Vector::Zero(20);
  const auto solver = make_levenberg_marquardt({.initial_damping = 1e-12});
  const double least = 0.5 * std::pow(least_squares(A, b).residual_norm, 2);
  for (const Matrix& columns : {A, redundant}) {
    const Vector start = random.normal(columns.cols(), 1);
    const Solution one = solver->minimise(LinearResidual(columns, b), start, 1);
    CHECK(one.iterations == 1);
    CHECK(one.cost == Approx(least).epsilon(1e-8));
    CHECK(solver->minimise(LinearResidual(columns, b), start, 50).status == Status::ok);
    CHECK(solver->minimise(LinearResidual(columns, b), start, 50).theta.allFinite());
  }
}

TEST_CASE("solvers: the cap on iterations holds, is reported, and the cost never rises") {
  for (const SolverPiece& solver : all_of(solver_table())) {
    double previous = std::numeric_limits<double>::infinity();
    for (const Index cap : {1, 2, 4, 8}) {
      const Solution stopped = solver->minimise(Rosenbrock{}, kValleyStart, cap);
      CHECK(stopped.status == Status::iteration_limit);
      CHECK(stopped.iterations == cap);
      CHECK_FALSE(stopped.message.empty());
      CHECK(stopped.cost <= previous);
      previous = stopped.cost;
    }
  }
}

TEST_CASE("solvers: from a point without derivatives they turn back and go on by shorter steps") {
  for (const SolverPiece& solver : all_of(solver_table()))
    for (const double edge : {-0.02, -0.1, -0.5})
      for (const double start : {1.0, 1.2, 1.3, 1.35}) {
        CAPTURE(solver->name(), edge, start);
        const Solution found = solver->minimise(ArcTangent(edge), Vector::Constant(1, start), 100);
        CAPTURE(found.message, found.iterations);
        CHECK(found.status == Status::ok);
        CHECK(std::abs(found.theta(0)) < 1e-4);
      }
}

TEST_CASE("solvers: a point whose Gauss-Newton matrix overflows ends no process and is no place to go on from") {
  // r = (a - 1, b - 0.6), with a ripple beyond b = 0.5 whose slope is 1e160 and whose square is infinite.
  class Ripple final : public ResidualProblem {
   public:
    Index parameters() const override { return 2; }
    Index residuals() const override { return 2; }
    bool residual(ConstVectorRef x, VectorRef r) const override {
      r << x(0) - 1, x(1) - 0.6;
      return true;
    }
    bool jacobian(ConstVectorRef x, VectorRef r, MatrixRef J) const override {
      J.setIdentity();
      if (x(1) > 0.5) J(1, 1) = 1e160;
      return residual(x, r);
    }
  };
  const Vector start = (Vector(2) << 0, 0.4).finished();
  for (const auto& [name, solver] : pieces_of(solver_table())) {
    CAPTURE(name);
    const Solution found = solver->minimise(Ripple{}, start, {60, 400});
    CHECK(all_finite(found.theta));
    CHECK(found.cost <= 0.52);
  }
}

TEST_CASE("solvers: a start outside the domain is said so and returned, a domain's edge is not crossed") {
  for (const SolverPiece& solver : all_of(solver_table())) {
    Rosenbrock walled;
    walled.limit = -2;
    CAPTURE(solver->name());
    const Solution refused = solver->minimise(walled, kValleyStart, 50);
    CHECK(refused.status == Status::outside_domain);
    CHECK_FALSE(refused.message.empty());
    CHECK(same_bits(refused.theta, kValleyStart));
    walled.limit = 0.5;  // the minimum lies beyond
    const Solution held = solver->minimise(walled, kValleyStart, 200);
    CAPTURE(held.message, held.iterations, held.evaluations.total(), held.theta(0), held.theta(1));
    CHECK(held.theta(0) < 0.5);
    CHECK(held.cost < 0.5 * 0.6 * 0.6);
    const Solution undefined = solver->minimise(Rosenbrock{}, Vector::Constant(2, kNaN), 50);
    CHECK(undefined.status == Status::outside_domain);
  }
}
