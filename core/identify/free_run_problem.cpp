#include "core/identify/free_run_problem.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/optimise/prior.hpp"

namespace wheelhop {
namespace {

constexpr Index kStage = 8;  // iterations before the prior is weighed again

class FreeRunProblem final : public ResidualProblem {
 public:
  FreeRunProblem(const NonlinearModel& model, ConstMatrixRef u, ConstMatrixRef y, ConstVectorRef weight_std, Index skip)
      : model_(model), limits_(model.limits), u_(u), y_(y), weight_(weight_std.cwiseInverse()), skip_(skip) {
    model_.limits = {};
  }

  Index parameters() const override { return layout_of(model_).size(); }
  Index residuals() const override { return y_.rows() * (y_.cols() - skip_); }
  Box box() const override {
    const Vector least = model_.map ? model_.map->lower() : Vector();
    if (least.size() == 0) return {};
    const double infinity = std::numeric_limits<double>::infinity();
    Box box{Vector::Constant(parameters(), -infinity), Vector::Constant(parameters(), infinity)};
    box.lower.segment(layout_of(model_).theta(), least.size()) = least;
    return box;
  }

  bool residual(ConstVectorRef theta, VectorRef r) const override {
    const Index p = y_.rows();
    return errors(theta,
                  [&](Index sample, ConstMatrixRef error) {
                    r.segment(p * sample, error.size()) = (weight_.asDiagonal() * error).reshaped();
                  }) &&
           r.allFinite();
  }

  bool cost(ConstVectorRef theta, double& cost) const override {
    cost = 0;
    return errors(theta,
                  [&](Index, ConstMatrixRef error) { cost += 0.5 * (weight_.asDiagonal() * error).squaredNorm(); }) &&
           std::isfinite(cost);
  }

  bool jacobian(ConstVectorRef theta, VectorRef r, MatrixRef J) const override {
    const ParameterLayout at = layout_of(model_);
    const SensitivityRow row(at);
    J.setZero();
    return sweep(theta,
                 [&](Index sample, Index i, ConstMatrixRef rows) {
                   for (Index k = 0; k < rows.cols(); ++k) {
                     const Vector values = weight_(i) * rows.col(k);
                     const Index residual = at.p * (sample + k) + i;
                     J.row(residual).head(at.dynamic()) = values.head(at.dynamic());
                     for (Index j = 0; j < at.regressors(); ++j)
                       J(residual, at.direct(i, j)) = values(row.regressors + j);
                     r(residual) = values(row.output);
                   }
                 }) &&
           r.allFinite();
  }

  bool normal_equations(ConstVectorRef theta, double& cost, Vector& gradient, Matrix& gauss_newton) const override {
    const ParameterLayout at = layout_of(model_);
    const SensitivityRow row(at);
    std::vector<Matrix> products(static_cast<std::size_t>(at.p), Matrix::Zero(row.size, row.size));
    if (!sweep(theta, [&](Index, Index i, ConstMatrixRef rows) {
          products[static_cast<std::size_t>(i)].selfadjointView<Eigen::Lower>().rankUpdate(rows);
        }))
      return false;
    cost = 0;
    gradient.setZero(at.size());
    gauss_newton.setZero(at.size(), at.size());
    for (Index i = 0; i < at.p; ++i) {
      const Matrix G = weight_(i) * weight_(i) * products[static_cast<std::size_t>(i)];
      const Index D = at.dynamic();
      cost += 0.5 * G(row.output, row.output);
      gradient.head(D) += G.row(row.output).head(D);
      gauss_newton.topLeftCorner(D, D) += G.topLeftCorner(D, D);
      for (Index j = 0; j < at.regressors(); ++j) {
        const Index own = at.direct(i, j), from = row.regressors + j;
        gradient(own) = G(row.output, from);
        gauss_newton.row(own).head(D) = G.row(from).head(D);
        for (Index l = 0; l <= j; ++l) gauss_newton(own, at.direct(i, l)) = G(from, row.regressors + l);
      }
    }
    return std::isfinite(cost);
  }

 private:
  /// Calls receive(first sample, y_hat - y) for the scored part of each block of the free run.
  template <class Receive>
  bool errors(ConstVectorRef theta, const Receive& receive) const {
    NonlinearModel model = model_;
    Vector x0;
    unpack(theta, model, x0);
    const Index stopped_at = free_run_in_blocks(model, u_, x0, [&](const FreeRunBlock& block) {
      const Index drop = std::max<Index>(skip_ - block.first, 0), count = block.y.cols() - drop;
      if (count <= 0) return;
      const Index sample = block.first + drop;
      Matrix error = block.y.rightCols(count) - y_.middleCols(sample, count);
      excuse_beyond(limits_, y_.middleCols(sample, count), error);
      receive(sample - skip_, error);
    });
    return stopped_at < 0;
  }

  /// Calls receive(first residual sample, output, rows) for the scored part of each block; the rows' outputs are
  /// errors.
  template <class Receive>
  bool sweep(ConstVectorRef theta, const Receive& receive) const {
    NonlinearModel model = model_;
    Vector x0;
    unpack(theta, model, x0);
    const SensitivityRow row(layout_of(model));
    return free_run_sensitivities(model, u_, x0, [&](Index first, Index samples, std::vector<Matrix>& rows) {
      const Index drop = std::max<Index>(skip_ - first, 0), count = samples - drop;
      if (count <= 0) return;
      for (Index i = 0; i < y_.rows(); ++i) {
        auto scored = rows[static_cast<std::size_t>(i)].middleCols(drop, count);
        const auto y = y_.row(i).segment(first + drop, count);
        scored.row(row.output) -= y;
        for (Index k = 0; k < count && limits_.any(); ++k)
          if (lies_beyond(limits_, i, y(k), scored(row.output, k))) scored.col(k).setZero();
        receive(first + drop - skip_, i, scored);
      }
    });
  }

  NonlinearModel model_;  // without its limits
  OutputLimits limits_;
  ConstMatrixRef u_, y_;
  Vector weight_;
  Index skip_;
};

/// The problems of several records with one model: theta as of the first, then the initial states of the others.
class RecordsProblem final : public ResidualProblem {
 public:
  RecordsProblem(const NonlinearModel& model, const std::vector<FittedRecord>& records, ConstVectorRef weight_std)
      : at_(layout_of(model)) {
    for (const FittedRecord& record : records)
      parts_.push_back(std::make_unique<FreeRunProblem>(model, record.u, record.y, weight_std, record.skip));
  }

  Vector start(const NonlinearModel& model, const std::vector<FittedRecord>& records) const {
    Vector theta(parameters());
    theta.head(at_.size()) = pack(model, records.front().x0);
    for (std::size_t i = 1; i < records.size(); ++i) theta.segment(state_at(i), at_.n) = records[i].x0;
    return theta;
  }

  /// Parameters of record i alone.
  Vector of_record(ConstVectorRef theta, std::size_t i) const {
    Vector own = theta.head(at_.size());
    own.segment(at_.x0(), at_.n) = theta.segment(state_at(i), at_.n);
    return own;
  }

  Index parameters() const override { return state_at(parts_.size()); }
  Index residuals() const override {
    Index count = 0;
    for (const auto& part : parts_) count += part->residuals();
    return count;
  }
  Box box() const override {
    const Box own = parts_.front()->box();
    if (own.lower.size() == 0) return {};
    const double infinity = std::numeric_limits<double>::infinity();
    Box box{Vector::Constant(parameters(), -infinity), Vector::Constant(parameters(), infinity)};
    box.lower.head(own.lower.size()) = own.lower;
    box.upper.head(own.upper.size()) = own.upper;
    return box;
  }

  bool residual(ConstVectorRef theta, VectorRef r) const override {
    Index at = 0;
    for (std::size_t i = 0; i < parts_.size(); at += parts_[i]->residuals(), ++i)
      if (!parts_[i]->residual(of_record(theta, i), r.segment(at, parts_[i]->residuals()))) return false;
    return true;
  }

  bool jacobian(ConstVectorRef theta, VectorRef r, MatrixRef J) const override {
    J.setZero();
    Index at = 0;
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      const Index count = parts_[i]->residuals();
      Matrix own(count, at_.size());
      if (!parts_[i]->jacobian(of_record(theta, i), r.segment(at, count), own)) return false;
      for (Index j = 0; j < at_.size(); ++j) J.col(place(j, i)).segment(at, count) = own.col(j);
      at += count;
    }
    return true;
  }

  bool normal_equations(ConstVectorRef theta, double& cost, Vector& gradient, Matrix& gauss_newton) const override {
    cost = 0;
    gradient.setZero(parameters());
    gauss_newton.setZero(parameters(), parameters());
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      double own_cost = 0;
      Vector own_gradient;
      Matrix own;
      if (!parts_[i]->normal_equations(of_record(theta, i), own_cost, own_gradient, own)) return false;
      cost += own_cost;
      for (Index j = 0; j < at_.size(); ++j) {
        gradient(place(j, i)) += own_gradient(j);
        for (Index l = 0; l <= j; ++l) {
          const Index row = place(j, i), column = place(l, i);
          gauss_newton(std::max(row, column), std::min(row, column)) += own(j, l);
        }
      }
    }
    return std::isfinite(cost);
  }

 private:
  Index state_at(std::size_t i) const { return i == 0 ? at_.x0() : at_.size() + (static_cast<Index>(i) - 1) * at_.n; }
  /// Where parameter j of record i stands.
  Index place(Index j, std::size_t i) const {
    return j >= at_.x0() && j < at_.x0() + at_.n ? state_at(i) + j - at_.x0() : j;
  }

  ParameterLayout at_;
  std::vector<std::unique_ptr<FreeRunProblem>> parts_;
};

Vector map_precision(const NonlinearModel& model, Index parameters) {
  Vector precision = Vector::Zero(parameters);
  if (model.map) precision.segment(layout_of(model).theta(), model.map->parameters()) = model.map->precision();
  return precision;
}

/// One solver call a stage under the prior of the map.
Solution minimise_in_stages(const ResidualProblem& problem, const Vector& precision, Vector start, const Solver& solver,
                            const Budget& budget) {
  Solution solution;
  solution.theta = std::move(start);
  // A prior weighs against the residual's variance, which falls: while it halves, the stages are short.
  double variance = residual_variance(problem, solution.theta);
  bool halved = true, more = true;
  while (more) {
    const auto with_weights = with_prior(problem, Vector::Zero(precision.size()), variance * precision);
    const Index done = solution.iterations, left = budget.iterations - done;
    const Evaluations before_stage = solution.evaluations;
    Solution stage =
        solver.minimise(*with_weights, solution.theta,
                        {halved ? std::min(kStage, left) : left, budget.evaluations - before_stage.total()});
    // A later stage may find no derivatives where the one before ended: that one stands.
    if (stage.status == Status::outside_domain && done > 0) break;
    solution = std::move(stage);
    solution.iterations += done;
    solution.evaluations.costs += before_stage.costs;
    solution.evaluations.linearisations += before_stage.linearisations;
    const double before = std::exchange(variance, residual_variance(problem, solution.theta));
    more = solution.status != Status::outside_domain && solution.iterations < budget.iterations &&
           solution.evaluations.total() < budget.evaluations && (halved || variance < 0.5 * before);
    halved = variance < 0.5 * before;
  }
  return solution;
}

}  // namespace

std::unique_ptr<ResidualProblem> free_run_problem(const NonlinearModel& model, ConstMatrixRef u, ConstMatrixRef y,
                                                  ConstVectorRef weight_std, Index skip) {
  return std::make_unique<FreeRunProblem>(model, u, y, weight_std, skip);
}

Refinement refine(const NonlinearModel& model, ConstVectorRef x0, ConstMatrixRef u, ConstMatrixRef y,
                  ConstVectorRef weight_std, Index skip, const Solver& solver, const Budget& budget) {
  const FreeRunProblem problem(model, u, y, weight_std, skip);
  Refinement result{
      minimise_in_stages(problem, map_precision(model, problem.parameters()), pack(model, x0), solver, budget), model,
      x0};
  const Solution& solution = result.solution;
  if (solution.status != Status::outside_domain) unpack(solution.theta, result.model, result.x0);
  return result;
}

Refinement refine(const NonlinearModel& model, std::vector<FittedRecord>& records, ConstVectorRef weight_std,
                  const Solver& solver, const Budget& budget) {
  const RecordsProblem problem(model, records, weight_std);
  Refinement result{minimise_in_stages(problem, map_precision(model, problem.parameters()),
                                       problem.start(model, records), solver, budget),
                    model, records.front().x0};
  if (result.solution.status == Status::outside_domain) return result;
  for (std::size_t i = 0; i < records.size(); ++i)
    unpack(problem.of_record(result.solution.theta, i), result.model, records[i].x0);
  result.x0 = records.front().x0;
  return result;
}

}  // namespace wheelhop
