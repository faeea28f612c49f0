/// \file
/// Interface between nonlinear least-squares problems and the solvers that minimise them.
#pragma once

#include <limits>
#include <string>

#include "core/base/linalg.hpp"
#include "core/base/status.hpp"
#include "core/optimise/block_angular.hpp"

namespace wheelhop {

/// Bounds of theta, one value a parameter in each; both empty: none.
struct Box {
  Vector lower, upper;
};

/// Minimise 1/2 ||r(theta)||^2 over a box. All that a solver may use stands here: residual, Jacobian, cost, gradient,
/// Gauss-Newton matrix and bounds. Every method may answer false: theta lies outside the domain (a diverged free run),
/// which is an answer, not an error.
class ResidualProblem {
 public:
  virtual ~ResidualProblem() = default;
  virtual Index parameters() const = 0;
  virtual Index residuals() const = 0;
  virtual Box box() const { return {}; }

  /// r(theta). @param r residuals() values out
  virtual bool residual(ConstVectorRef theta, VectorRef r) const = 0;

  /// r and its Jacobian. @param J residuals() x parameters()
  virtual bool jacobian(ConstVectorRef theta, VectorRef r, MatrixRef J) const = 0;

  /// Which parameters a residual depends on. Default: every one on all.
  virtual BlockAngular layout() const;

  /// r and the Jacobian as far as it is stored. @param J residuals() x layout().stored(). Default: jacobian().
  virtual bool stored_jacobian(ConstVectorRef theta, VectorRef r, MatrixRef J) const { return jacobian(theta, r, J); }

  /// cost = 1/2 r'r. Default: by residual().
  virtual bool cost(ConstVectorRef theta, double& cost) const;

  /// cost, gradient J'r and Gauss-Newton matrix J'J (lower triangle). Default: by stored_jacobian(); long records
  /// override it to accumulate block by block, so that memory does not grow with the record. A solver that needs the
  /// gradient alone asks for it here as well.
  virtual bool normal_equations(ConstVectorRef theta, double& cost, Vector& gradient, Matrix& gauss_newton) const;
};

/// How much a solver may ask of a problem. Whichever cap is reached first ends the search.
struct Budget {
  static constexpr Index kUnlimited = std::numeric_limits<Index>::max();

  /// @param outer_iterations see `iterations`   @param most_evaluations see `evaluations`
  Budget(Index outer_iterations, Index most_evaluations = kUnlimited)
      : iterations(outer_iterations), evaluations(most_evaluations) {}

  /// Outer iterations, >= 1: accepted steps of a trust-region or line-search method. A method that has none counts each
  /// gradient as one, and without gradients each parameters() + 1 costs, what a difference gradient would take.
  Index iterations;
  /// Answers of the problem, >= 1: residuals, costs and linearisations each count as one. The currency in which solvers
  /// of different kinds are compared.
  Index evaluations;
};

/// Answers a problem gave, counted by Solver::minimise.
struct Evaluations {
  Index costs = 0;           ///< of residual() and cost()
  Index linearisations = 0;  ///< of jacobian(), stored_jacobian() and normal_equations()
  Index total() const { return costs + linearisations; }
};

struct Solution {
  /// ok: a tolerance was met; iteration_limit: a cap of the budget was; outside_domain: theta0 already is; unavailable:
  /// the method cannot take this problem or is not in this build; failed: the method gave up, as the message tells.
  Status status = Status::failed;
  std::string message;
  Vector theta;
  double cost = 0;  ///< 1/2 ||r||^2 at theta
  /// Largest scaled gradient component inside the box, |J_i'r| / (|J_i| |r|). NaN, also where the status is ok, for a
  /// method that has no derivatives at theta.
  double gradient_norm = 0;
  Index iterations = 0;
  Evaluations evaluations;
};

class Solver {
 public:
  virtual ~Solver() = default;
  virtual std::string name() const = 0;

  /// Whether the method keeps theta inside a box. One that does not is refused by minimise() where a problem has one.
  virtual bool takes_bounds() const { return true; }

  /// The best point that the search finds within the budget.
  /// @param theta0 inside the problem's box, as every theta asked for later
  /// Status: unavailable if the problem has bounds and the method takes none; iteration_limit if either cap ended the
  /// search; else what the method says. The problem's answers are counted here, never by the method. Throws what the
  /// problem throws.
  Solution minimise(const ResidualProblem& problem, ConstVectorRef theta0, const Budget& budget) const;

 protected:
  /// The method itself. Once the budget's evaluations are spent, every call to `problem` answers false.
  virtual Solution search(const ResidualProblem& problem, ConstVectorRef theta0, const Budget& budget) const = 0;
};

}  // namespace wheelhop
