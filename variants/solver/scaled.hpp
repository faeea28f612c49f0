/// \file
/// What the adapters of other people's solvers share: the problem in scaled coordinates, and the best point seen.
#pragma once

#include <cmath>
#include <limits>

#include "core/optimise/bounded_step.hpp"
#include "core/optimise/solver.hpp"

namespace wheelhop {

/// theta = theta0 + scale .* z, cost = unit * value. Columns of the Jacobian have unit length at z = 0 and the value is
/// 1 there: general solvers know no metric of their own. Keeps the best point that answered.
class ScaledProblem {
 public:
  /// @param derivatives whether one linearisation at theta0 may be asked for; without it the scale is 1
  ScaledProblem(const ResidualProblem& problem, ConstVectorRef theta0, bool derivatives)
      : problem_(problem), theta0_(theta0), scale_(Vector::Ones(theta0.size())), best_(theta0) {
    Vector gradient;
    Matrix H;
    inside_ =
        derivatives ? problem.normal_equations(theta0_, best_cost_, gradient, H) : problem.cost(theta0_, best_cost_);
    inside_ = inside_ && std::isfinite(best_cost_);
    if (!inside_) return;
    unit_ = best_cost_ > 0 ? best_cost_ : 1;
    if (!derivatives) return;
    gradient_ = gradient;
    diagonal_ = H.diagonal();
    const double floor = 1e-14 * H.diagonal().maxCoeff() + 1e-300;
    scale_ = (H.diagonal().cwiseMax(floor) / unit_).cwiseSqrt().cwiseInverse();
  }

  Vector best() const { return (best_ - theta0_).cwiseQuotient(scale_); }  ///< z of the best point seen
  bool inside() const { return inside_; }                                  ///< theta0 lies in the domain
  Index parameters() const { return theta0_.size(); }
  Vector theta(ConstVectorRef z) const { return clamped(theta0_ + scale_.cwiseProduct(z), problem_.box()); }
  /// Bounds of z; infinite where there are none.
  Box box() const {
    const double infinity = std::numeric_limits<double>::infinity();
    const Box box = problem_.box();
    if (box.lower.size() == 0)
      return {Vector::Constant(parameters(), -infinity), Vector::Constant(parameters(), infinity)};
    return {(box.lower - theta0_).cwiseQuotient(scale_), (box.upper - theta0_).cwiseQuotient(scale_)};
  }

  bool value(ConstVectorRef z, double& value) {
    const Vector at = theta(z);
    double cost = 0;
    if (!problem_.cost(at, cost) || !std::isfinite(cost)) return false;
    keep(at, cost);
    value = cost / unit_;
    return true;
  }

  /// @param hessian the Gauss-Newton matrix, lower triangle
  bool derivatives(ConstVectorRef z, double& value, Vector& gradient, Matrix& hessian) {
    const Vector at = theta(z);
    double cost = 0;
    if (!problem_.normal_equations(at, cost, gradient, hessian) || !std::isfinite(cost) || !all_finite(gradient))
      return false;
    keep(at, cost);
    if (at == best_) {
      gradient_ = gradient;
      diagonal_ = hessian.diagonal();
    }
    value = cost / unit_;
    gradient = scale_.cwiseProduct(gradient) / unit_;
    hessian = scale_.asDiagonal() * hessian * scale_.asDiagonal() / unit_;
    // Infinite entries crash the factorisations of other people's solvers.
    return all_finite(gradient) && all_finite(Matrix(hessian.triangularView<Eigen::Lower>()));
  }

  /// The best point so far with status and message of the search.
  Solution solution(Status status, std::string message, Index iterations) const {
    Solution found;
    found.status = inside_ ? status : Status::outside_domain;
    found.message = inside_ ? std::move(message) : "the starting point lies outside the domain of the problem";
    found.theta = best_;
    found.cost = best_cost_;
    found.iterations = iterations;
    found.gradient_norm = std::numeric_limits<double>::quiet_NaN();
    if (gradient_.size() == 0) return found;
    const Vector free = projected_gradient(gradient_, best_, problem_.box());
    found.gradient_norm = 0;
    for (Index i = 0; i < free.size(); ++i)
      if (diagonal_(i) > 0)
        found.gradient_norm = std::max(found.gradient_norm,
                                       std::abs(free(i)) / std::sqrt(std::max(2 * diagonal_(i) * best_cost_, 1e-300)));
    return found;
  }

  /// Sets components of the best point that stand near a bound on it, where the cost does not rise: an interior-point
  /// method ends short of the bounds that hold it. @param near in units of z
  void settle_on_bounds(double near) {
    const Box box = problem_.box();
    if (box.lower.size() == 0) return;
    Vector moved = best_;
    for (Index i = 0; i < moved.size(); ++i) {
      if (moved(i) - box.lower(i) < near * scale_(i)) moved(i) = box.lower(i);
      if (box.upper(i) - moved(i) < near * scale_(i)) moved(i) = box.upper(i);
    }
    double cost = 0;
    Vector gradient;
    Matrix hessian;
    if (moved == best_ || !problem_.normal_equations(moved, cost, gradient, hessian) || !(cost <= best_cost_)) return;
    best_ = moved;
    best_cost_ = cost;
    gradient_ = gradient;
    diagonal_ = hessian.diagonal();
  }

 private:
  void keep(const Vector& theta, double cost) {
    if (!(cost < best_cost_)) return;
    best_ = theta;
    best_cost_ = cost;
    gradient_.resize(0);  // that of another point
  }

  const ResidualProblem& problem_;
  Vector theta0_, scale_, best_, gradient_, diagonal_;
  double best_cost_ = 0, unit_ = 1;
  bool inside_ = false;
};

}  // namespace wheelhop
