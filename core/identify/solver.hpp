/// \file
/// Interface between nonlinear least-squares problems and the solvers that minimise them.
#pragma once

#include <string>

#include "core/base/linalg.hpp"
#include "core/base/status.hpp"

namespace wheelhop {

/// Bounds of theta, one value a parameter in each; both empty: none.
struct Box {
  Vector lower, upper;
};

/// Minimise 1/2 ||r(theta)||^2 over a box. Every method may answer false: theta lies outside the domain (a diverged
/// free run), which is an answer, not an error.
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

  /// cost = 1/2 r'r. Default: by residual().
  virtual bool cost(ConstVectorRef theta, double& cost) const;

  /// cost, gradient J'r and Gauss-Newton matrix J'J (lower triangle). Default: by jacobian(); long records override it
  /// to accumulate block by block, so that memory does not grow with the record.
  virtual bool normal_equations(ConstVectorRef theta, double& cost, Vector& gradient, Matrix& gauss_newton) const;
};

struct Solution {
  Status status = Status::failed;  ///< ok: a tolerance was met; iteration_limit; outside_domain: already theta0 is
  std::string message;
  Vector theta;
  double cost = 0;           ///< 1/2 ||r||^2 at theta
  double gradient_norm = 0;  ///< largest scaled gradient component inside the box, |J_i'r| / (|J_i| |r|)
  Index iterations = 0;
};

class Solver {
 public:
  virtual ~Solver() = default;
  virtual std::string name() const = 0;
  /// @param theta0 inside the problem's box, as every theta asked for later   @param iterations cap on outer
  /// iterations, >= 1
  virtual Solution minimise(const ResidualProblem& problem, ConstVectorRef theta0, Index iterations) const = 0;
};

}  // namespace wheelhop
