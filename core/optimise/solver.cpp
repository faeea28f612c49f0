#include "core/optimise/solver.hpp"

#include <fmt/format.h>

#include <exception>
#include <limits>

namespace wheelhop {
namespace {

/// A problem whose answers are counted, and refused once a number of them was given. What the problem throws is kept
/// and thrown again by minimise(): other people's libraries need not let it through.
class CountedProblem final : public ResidualProblem {
 public:
  CountedProblem(const ResidualProblem& problem, Index most) : problem_(problem), most_(most) {}

  Index parameters() const override { return problem_.parameters(); }
  Index residuals() const override { return problem_.residuals(); }
  Box box() const override { return problem_.box(); }
  BlockAngular layout() const override { return problem_.layout(); }
  bool residual(ConstVectorRef theta, VectorRef r) const override {
    return ask(counted.costs, [&] { return problem_.residual(theta, r); });
  }
  bool cost(ConstVectorRef theta, double& cost) const override {
    return ask(counted.costs, [&] { return problem_.cost(theta, cost); });
  }
  bool jacobian(ConstVectorRef theta, VectorRef r, MatrixRef J) const override {
    return ask(counted.linearisations, [&] { return problem_.jacobian(theta, r, J); });
  }
  bool stored_jacobian(ConstVectorRef theta, VectorRef r, MatrixRef J) const override {
    return ask(counted.linearisations, [&] { return problem_.stored_jacobian(theta, r, J); });
  }
  bool normal_equations(ConstVectorRef theta, double& cost, Vector& gradient, Matrix& gauss_newton) const override {
    return ask(counted.linearisations, [&] { return problem_.normal_equations(theta, cost, gradient, gauss_newton); });
  }

  mutable Evaluations counted;
  mutable bool refused = false;  ///< an answer was asked for beyond the budget
  mutable std::exception_ptr thrown;

 private:
  template <class Answer>
  bool ask(Index& kind, const Answer& answer) const {
    if (thrown) return false;
    if (counted.total() >= most_) {
      refused = true;
      return false;
    }
    ++kind;
    try {
      return answer();
    } catch (...) {
      thrown = std::current_exception();
      return false;
    }
  }

  const ResidualProblem& problem_;
  Index most_;
};

}  // namespace

BlockAngular ResidualProblem::layout() const { return {parameters(), 0, 1, {{0, residuals(), 0}}}; }

bool ResidualProblem::cost(ConstVectorRef theta, double& cost) const {
  Vector r(residuals());
  if (!residual(theta, r)) return false;
  cost = 0.5 * r.squaredNorm();
  return true;
}

bool ResidualProblem::normal_equations(ConstVectorRef theta, double& cost, Vector& gradient,
                                       Matrix& gauss_newton) const {
  const BlockAngular blocks = layout();
  Vector r(residuals());
  Matrix J(residuals(), blocks.stored());
  if (!stored_jacobian(theta, r, J)) return false;
  cost = 0.5 * r.squaredNorm();
  gradient = blocks.transposed_times(J, r);
  gauss_newton = blocks.lower_gram(J);
  return true;
}

Solution Solver::minimise(const ResidualProblem& problem, ConstVectorRef theta0, const Budget& budget) const {
  if (!takes_bounds() && problem.box().lower.size() > 0) {
    Solution refused;
    refused.status = Status::unavailable;
    refused.message = name() + " keeps no bounds, and this problem has some";
    refused.theta = theta0;
    refused.cost = std::numeric_limits<double>::infinity();
    return refused;
  }
  const CountedProblem counted(problem, budget.evaluations);
  Solution solution = search(counted, theta0, budget);
  if (counted.thrown) std::rethrow_exception(counted.thrown);
  solution.evaluations = counted.counted;
  if (counted.refused && solution.status != Status::outside_domain) {
    solution.status = Status::iteration_limit;
    solution.message = fmt::format("the budget of {} evaluations is spent", budget.evaluations);
  }
  return solution;
}

}  // namespace wheelhop
