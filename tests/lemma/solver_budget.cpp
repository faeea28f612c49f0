// Budgets and bounds: rules that hold for every solver because they stand around it.
#include <catch2/catch.hpp>
#include <cmath>

#include "tests/support/pieces.hpp"
#include "tests/support/systems.hpp"
#include "variants/solver/nlopt.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

namespace {

/// Exponentials r_i = exp(-a t_i) - b e^(-c t_i): counts its own answers.
class Curves final : public ResidualProblem {
 public:
  Index parameters() const override { return 3; }
  Index residuals() const override { return 20; }
  Box box() const override { return bounds; }
  bool residual(ConstVectorRef x, VectorRef r) const override {
    ++answers;
    evaluate(x, r, nullptr);
    return true;
  }
  bool jacobian(ConstVectorRef x, VectorRef r, MatrixRef J) const override {
    ++answers;
    evaluate(x, r, &J);
    return true;
  }
  Box bounds;
  mutable Index answers = 0;

 private:
  static void evaluate(ConstVectorRef x, VectorRef r, MatrixRef* J) {
    for (Index i = 0; i < r.size(); ++i) {
      const double t = 0.1 * static_cast<double>(i), fast = std::exp(-x(0) * t), slow = std::exp(-x(2) * t);
      r(i) = fast + x(1) * slow - 2 * std::exp(-t) - 0.5 * std::exp(-3 * t);
      if (J != nullptr) J->row(i) << -t * fast, slow, -x(1) * t * slow;
    }
  }
};

const Vector kStart = (Vector(3) << 2, 1, 0.3).finished();

/// Every solver, and NLopt with each of its algorithms.
std::vector<Named<SolverPiece>> solvers() {
  std::vector<Named<SolverPiece>> all = pieces_of(solver_table());
  if (!nlopt_unavailable().empty()) return all;
  NloptOptions options;
  for (const OptionInfo& option : describe_options<NloptOptions>()) {
    if (option.name != "algorithm") continue;
    std::string name;
    for (const char letter : option.range + " ")
      if (letter == ' ' || letter == '|') {
        if (!name.empty()) {
          options.algorithm = name;
          all.push_back({"nlopt " + name, make_nlopt(options)});
        }
        name.clear();
      } else {
        name += letter;
      }
  }
  return all;
}

}  // namespace

TEST_CASE(
    "evaluations are counted around the solver: what a problem answered, no more than the budget, the cost the best") {
  for (const auto& [name, solver] : solvers())
    for (const Index most : {1, 2, 7, 40}) {
      Curves problem;
      const Solution found = solver->minimise(problem, kStart, {1000, most});
      CAPTURE(name, most, found.message);
      CHECK(found.evaluations.total() == problem.answers);
      CHECK(found.evaluations.total() <= most);
      Vector r(20);
      problem.residual(found.theta, r);
      CHECK(found.cost == Approx(0.5 * r.squaredNorm()));
      problem.residual(kStart, r);
      CHECK(found.cost <= 0.5 * r.squaredNorm() * (1 + 1e-12));
      if (most <= 2) CHECK(found.status == Status::iteration_limit);
    }
}

TEST_CASE("a larger budget never ends higher") {
  for (const auto& [name, solver] : solvers()) {
    double previous = std::numeric_limits<double>::infinity();
    for (const Index most : {3, 10, 30, 100, 300}) {
      const double cost = solver->minimise(Curves{}, kStart, {1000, most}).cost;
      CAPTURE(name, most);
      CHECK(cost <= previous * (1 + 1e-9));
      previous = cost;
    }
  }
}

TEST_CASE(
    "bounds are kept by every solver that takes them, and one that does not is refused where a problem has some") {
  const double infinity = std::numeric_limits<double>::infinity();
  for (const auto& [name, solver] : solvers()) {
    Curves problem;
    problem.bounds = {(Vector(3) << 1.5, 0, -infinity).finished(), (Vector(3) << 4, 1.2, infinity).finished()};
    const Solution found = solver->minimise(problem, kStart, {300, 3000});
    CAPTURE(name, found.message);
    if (!solver->takes_bounds()) {
      CHECK(found.status == Status::unavailable);
      CHECK_THAT(found.message, Catch::Contains("bounds"));
      CHECK(problem.answers == 0);
      continue;
    }
    CHECK((found.theta - problem.bounds.lower).minCoeff() >= 0);
    CHECK((problem.bounds.upper - found.theta).minCoeff() >= 0);
    CHECK(found.cost < 0.08823);  // 0.0882176 at the minimum
  }
}

TEST_CASE("solvers with the same problem reach the same minimum") {
  double least = std::numeric_limits<double>::infinity();
  std::vector<std::pair<std::string, double>> ends;
  for (const auto& [name, solver] : pieces_of(solver_table())) {
    ends.push_back({name, solver->minimise(Curves{}, kStart, {2000, 2000}).cost});
    least = std::min(least, ends.back().second);
  }
  for (const auto& [name, cost] : ends) {
    CAPTURE(name, cost, least);
    CHECK(cost < 1.001 * least);
  }
}

TEST_CASE("what a problem throws comes out of every solver, through whichever library it runs") {
  struct Throwing final : ResidualProblem {
    Index parameters() const override { return 3; }
    Index residuals() const override { return 20; }
    bool residual(ConstVectorRef theta, VectorRef r) const override {
      if (++answers > 3) throw UserError("the problem is broken");
      return curves.residual(theta, r);
    }
    bool jacobian(ConstVectorRef theta, VectorRef r, MatrixRef J) const override {
      if (++answers > 3) throw UserError("the problem is broken");
      return curves.jacobian(theta, r, J);
    }
    Curves curves;
    mutable Index answers = 0;
  };
  for (const auto& [name, solver] : solvers()) {
    CAPTURE(name);
    CHECK_THROWS_WITH(solver->minimise(Throwing{}, kStart, {200, 200}), "the problem is broken");
  }
}
