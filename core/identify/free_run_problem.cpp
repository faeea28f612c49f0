#include "core/identify/free_run_problem.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>

#include "core/identify/input_matrices.hpp"
#include "core/identify/prior.hpp"

namespace wheelhop {
namespace {

constexpr Index kStage = 8;  // iterations before the prior is weighed again

class FreeRunProblem final : public ResidualProblem {
 public:
  FreeRunProblem(const NonlinearModel& model, ConstMatrixRef u, ConstMatrixRef y, ConstVectorRef weight_std, Index skip)
      : model_(model), u_(u), y_(y), weight_(weight_std.cwiseInverse()), skip_(skip) {}

  Index parameters() const override { return layout_of(model_).size(); }
  Index residuals() const override { return y_.rows() * (y_.cols() - skip_); }

  bool residual(ConstVectorRef theta, VectorRef r) const override {
    NonlinearModel model = model_;
    Vector x0;
    unpack(theta, model, x0);
    const FreeRun run = free_run(model, u_, x0);
    if (run.status != Status::ok) return false;
    const Index kept = y_.cols() - skip_;
    r.reshaped(y_.rows(), kept) = weight_.asDiagonal() * (run.y - y_).rightCols(kept);
    return r.allFinite();
  }

  bool jacobian(ConstVectorRef theta, VectorRef r, MatrixRef J) const override {
    return sweep(theta, [&](Index row, ConstMatrixRef error, ConstMatrixRef weighted) {
      r.segment(row, error.size()) = error.reshaped();
      J.middleRows(row, error.size()) = weighted.transpose();
    });
  }

  bool normal_equations(ConstVectorRef theta, double& cost, Vector& gradient, Matrix& gauss_newton) const override {
    cost = 0;
    gradient.setZero(parameters());
    gauss_newton.setZero(parameters(), parameters());
    return sweep(theta, [&](Index, ConstMatrixRef error, ConstMatrixRef weighted) {
      cost += 0.5 * error.squaredNorm();
      gradient.noalias() += weighted * error.reshaped();
      gauss_newton.selfadjointView<Eigen::Lower>().rankUpdate(weighted);
    });
  }

 private:
  /// Calls receive(first row, weighted error p x K, weighted Jacobian P x (p K)) for the scored part of each block.
  template <class Receive>
  bool sweep(ConstVectorRef theta, const Receive& receive) const {
    NonlinearModel model = model_;
    Vector x0;
    unpack(theta, model, x0);
    const Index p = y_.rows();
    Matrix error, weighted;
    bool finite = true;
    const bool unweighted = (weight_.array() == 1).all();
    const bool inside = free_run_sensitivities(model, u_, x0, [&](Index first, ConstMatrixRef y, ConstMatrixRef J) {
      const Index drop = std::min(std::max<Index>(skip_ - first, 0), y.cols()), count = y.cols() - drop;
      if (count == 0) return;
      error = weight_.asDiagonal() * (y.rightCols(count) - y_.middleCols(first + drop, count));
      finite = finite && all_finite(error);
      const Index row = p * (first + drop - skip_);
      if (unweighted) {  // signals scaled beforehand: no copy of the largest matrix there is
        receive(row, error, J.rightCols(p * count));
        return;
      }
      weighted.noalias() = J.rightCols(p * count) * weight_.replicate(count, 1).asDiagonal();
      receive(row, error, weighted);
    });
    return inside && finite;
  }

  NonlinearModel model_;
  Matrix u_, y_;
  Vector weight_;
  Index skip_;
};

}  // namespace

std::unique_ptr<ResidualProblem> free_run_problem(const NonlinearModel& model, ConstMatrixRef u, ConstMatrixRef y,
                                                  ConstVectorRef weight_std, Index skip) {
  return std::make_unique<FreeRunProblem>(model, u, y, weight_std, skip);
}

Refinement refine(const NonlinearModel& model, ConstVectorRef x0, ConstMatrixRef u, ConstMatrixRef y,
                  ConstVectorRef weight_std, Index skip, const Solver& solver, Index iterations) {
  const FreeRunProblem problem(model, u, y, weight_std, skip);
  Vector precision = Vector::Zero(problem.parameters());
  if (model.map) precision.segment(layout_of(model).theta(), model.map->parameters()) = model.map->precision();
  Refinement result{{}, model, x0};
  Solution& solution = result.solution;
  solution.theta = pack(model, x0);
  // A prior weighs against the residual's variance, which falls: while it halves, the stages are short.
  double variance = residual_variance(problem, solution.theta);
  bool halved = true, more = true;
  while (more) {
    const auto with_weights = with_prior(problem, Vector::Zero(precision.size()), variance * precision);
    const Index done = solution.iterations, left = iterations - done;
    solution = solver.minimise(*with_weights, solution.theta, halved ? std::min(kStage, left) : left);
    solution.iterations += done;
    const double before = std::exchange(variance, residual_variance(problem, solution.theta));
    more = solution.status != Status::outside_domain && solution.iterations < iterations &&
           (halved || variance < 0.5 * before);
    halved = variance < 0.5 * before;
  }
  if (solution.status != Status::outside_domain) unpack(solution.theta, result.model, result.x0);
  return result;
}

Vector estimate_initial_state(const NonlinearModel& model, ConstMatrixRef u, ConstMatrixRef y, Index samples) {
  samples = std::min(samples, u.cols());
  Vector x0 = estimate_initial_state(model.linear, u, y, samples);
  if (!model.map) return x0;
  const ParameterLayout at = layout_of(model);
  const Index p = y.rows(), n = at.n;
  const auto cost_at = [&](const Vector& x) {
    const FreeRun run = free_run(model, u.leftCols(samples), x);
    const double cost = (run.y - y.leftCols(samples)).squaredNorm();
    return run.status == Status::ok && std::isfinite(cost) ? cost : std::numeric_limits<double>::infinity();
  };
  double cost = cost_at(x0), damping = 1e-3;
  if (!std::isfinite(cost)) {
    x0.setZero();
    cost = cost_at(x0);
  }
  for (int iteration = 0; iteration < 30 && std::isfinite(cost); ++iteration) {
    Matrix H = Matrix::Zero(n, n);
    Vector g = Vector::Zero(n);
    if (!free_run_sensitivities(model, u.leftCols(samples), x0, [&](Index first, ConstMatrixRef run, ConstMatrixRef J) {
          const Matrix error = run - y.middleCols(first, run.cols());
          const auto own = J.middleRows(at.x0(), n);
          g.noalias() += own * error.reshaped(p * run.cols(), 1);
          H.noalias() += own * own.transpose();
        }))
      break;
    const double before = cost;
    for (int attempt = 0; attempt < 10; ++attempt, damping *= 10) {
      Matrix damped = H;
      damped.diagonal() *= 1 + damping;
      const Vector trial = x0 - damped.ldlt().solve(g);
      const double trial_cost = cost_at(trial);
      if (!(trial_cost < cost)) continue;
      x0 = trial;
      cost = trial_cost;
      damping *= 0.1;
      break;
    }
    if (!(cost < before * (1 - 1e-10))) break;
  }
  return x0;
}

}  // namespace wheelhop
