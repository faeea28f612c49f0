#include "core/identify/ridge.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/identify/judgements.hpp"
#include "core/identify/map_fit.hpp"

namespace wheelhop {
namespace {

using Maybe = std::optional<Refinement>;

class RidgeSearch {
 public:
  RidgeSearch(ConstMatrixRef u, ConstMatrixRef y, ConstVectorRef weight_std, Index skip, const Solver& solver,
              Index iterations, const RidgeFactory& make_ridge)
      : u_(u),
        y_(y),
        weight_std_(weight_std),
        skip_(skip),
        solver_(solver),
        iterations_(iterations),
        make_ridge_(make_ridge) {}

  /// N log(cost) + kJudged.worth_a_power parameters: twice the negative log likelihood with the noise's variance
  /// profiled out.
  double criterion(const NonlinearModel& model, double cost) const {
    return samples() * std::log(cost / samples()) +
           kJudged.worth_a_power * static_cast<double>(model.map->parameters());
  }
  double criterion(const Maybe& candidate) const {
    return candidate ? criterion(candidate->model, candidate->solution.cost) : std::numeric_limits<double>::infinity();
  }

  /// The polynomial along t nearest to the model's f, refined.
  Maybe refined(const NonlinearModel& model, ConstVectorRef x0, ConstVectorRef t, const RidgeForm& form) const {
    const Index inputs = model.order() + u_.rows();
    const std::unique_ptr<StaticMap> map = make_ridge_(inputs, form);
    if (map->inner_parameters() != inputs)
      throw UserError(map->name() + ": expected one direction, alpha of as many values as the map has inputs");
    map->alpha = t;
    WeightFit weights(*map);
    if (free_run_in_blocks(model, u_, x0, [&](const FreeRunBlock& block) {
          weights.add(stacked(block.x, u_.middleCols(block.first, block.x.cols())), block.f);
        }) >= 0)
      return {};
    MapFit fit;
    double sign = 1;
    for (const double way : {1.0, -1.0}) {  // which way f points is free, and weights of one sign want the right one
      if (way < 0 && !form.hardening) break;
      MapFit candidate = weights.finish(way);
      if (candidate.status != Status::ok || (fit.map && !(candidate.residual < fit.residual))) continue;
      fit = std::move(candidate);
      sign = way;
    }
    if (fit.status != Status::ok) return {};
    NonlinearModel start = model;
    start.map = fit.map;
    start.Bt *= sign;
    start.Dt *= sign;
    fold_linear_part(start, fit.linear);
    Refinement result = refine(start, x0, u_, y_, weight_std_, skip_, solver_, iterations_);
    const Status status = result.solution.status;
    if ((status != Status::ok && status != Status::iteration_limit) || !(result.solution.cost > 0)) return {};
    return result;
  }

  /// How many features, from the first, the record calls for: by the Wald statistic of the rest.
  Index needed(const Refinement& candidate) const {
    const NonlinearModel& model = candidate.model;
    const ParameterLayout at = layout_of(model);
    const Index h = model.map->features(), first = at.theta() + model.map->inner_parameters();
    double cost = 0;
    Vector gradient;
    Matrix H;
    if (!free_run_problem(model, u_, y_, weight_std_, skip_)
             ->normal_equations(candidate.solution.theta, cost, gradient, H))
      return h;
    const Vector scale = H.diagonal().cwiseSqrt().cwiseMax(1e-150).cwiseInverse();
    const SymmetricEigen eigen = symmetric_eigen(scale.asDiagonal() * H * scale.asDiagonal());
    // What no record determines (coordinates of the states, length of alpha) is held: a pseudo-inverse.
    const double least = 1e-11 * eigen.values.maxCoeff();
    const Vector inverse = eigen.values.unaryExpr([&](double value) { return value > least ? 1 / value : 0.0; });
    const Matrix own = (scale.asDiagonal() * eigen.vectors).middleRows(first, h);
    const Matrix covariance = (2 * cost / samples()) * own * inverse.asDiagonal() * own.transpose();
    const Vector W = model.map->W.row(0);
    Index best = h;
    double least_total = kJudged.worth_a_power * static_cast<double>(h);
    for (Index kept = h - 1; kept >= 1; --kept) {
      const Vector rest = W.tail(h - kept);
      const double wald = rest.dot(covariance.bottomRightCorner(h - kept, h - kept).ldlt().solve(rest));
      const double total = wald + kJudged.worth_a_power * static_cast<double>(kept);
      if (!(total < least_total)) continue;
      least_total = total;
      best = kept;
    }
    return best;
  }

 private:
  double samples() const { return static_cast<double>(y_.rows() * (y_.cols() - skip_)); }

  ConstMatrixRef u_, y_;
  ConstVectorRef weight_std_;
  Index skip_;
  const Solver& solver_;
  Index iterations_;
  const RidgeFactory& make_ridge_;
};

}  // namespace

SymmetricEigen active_subspace(const StaticMap& map, ConstMatrixRef xi) {
  constexpr Index block = 256;  // points whose gradients are held at once
  const Index d = xi.rows();
  const auto points = static_cast<double>(xi.cols());
  Matrix gradients(d, std::min(block, xi.cols())), sum = Matrix::Zero(d, d);
  Vector phi(map.features()), by_alpha(map.inner_parameters()), point(d);
  for (Index i = 0; i < map.outputs(); ++i) {
    const Vector w = map.W.row(i);
    Vector first_gradient(d), away = Vector::Zero(d);  // about the first one, so that nothing cancels
    for (Index first = 0; first < xi.cols(); first += block) {
      const Index count = std::min(block, xi.cols() - first);
      for (Index k = 0; k < count; ++k) {
        point = xi.col(first + k);
        map.basis(point.data(), phi.data());
        map.slopes(point.data(), phi.data(), w.data(), gradients.col(k).data(), by_alpha.data());
      }
      if (first == 0) first_gradient = gradients.col(0);
      auto now = gradients.leftCols(count);
      now.colwise() -= first_gradient;
      away += now.rowwise().sum();
      sum.noalias() += now * now.transpose();
    }
    sum -= away * away.transpose() / points;
  }
  return symmetric_eigen(sum);
}

ActiveDirection active_direction(const StaticMap& map, ConstMatrixRef xi) {
  const Index d = xi.rows();
  const SymmetricEigen eigen = active_subspace(map, xi);
  ActiveDirection found;
  found.t = eigen.vectors.col(d - 1);
  found.t /= std::max((xi.transpose() * found.t).cwiseAbs().maxCoeff(), 1e-300);
  const double total = eigen.values.sum();
  if (total > 0) found.share = eigen.values(d - 1) / total;
  return found;
}

Maybe fit_ridge(const NonlinearModel& model, ConstVectorRef x0, ConstMatrixRef u, ConstMatrixRef y,
                ConstVectorRef weight_std, Index skip, const Solver& solver, Index iterations,
                const RidgeFactory& make_ridge, const RidgeDegrees& degrees) {
  if (!make_ridge || degrees.any < 3 || !model.map || model.auxiliary_count() != 1) return {};
  double cost = 0;
  if (!free_run_problem(model, u, y, weight_std, skip)->cost(pack(model, x0), cost)) return {};
  const RidgeSearch search(u, y, weight_std, skip, solver, iterations, make_ridge);
  const double to_beat = search.criterion(model, cost);
  Matrix xi(model.order() + u.rows(), u.cols());
  xi.bottomRows(u.rows()) = u;
  free_run_in_blocks(model, u, x0, [&](const FreeRunBlock& block) {
    xi.block(0, block.first, model.order(), block.x.cols()) = block.x;
  });
  const ActiveDirection active = active_direction(*model.map, xi);
  if (!(active.share > kJudged.one_direction)) return {};

  Maybe best = search.refined(model, x0, active.t, {.degree = degrees.any});
  if (!best) return {};
  Maybe odd = search.refined(best->model, best->x0, best->model.map->alpha, {.degree = degrees.any, .odd = true});
  const bool is_odd = search.criterion(odd) < search.criterion(best);
  if (is_odd) best = std::move(odd);
  // A polynomial has the cube at least.
  const Index kept = is_odd ? search.needed(*best) : std::max<Index>(search.needed(*best), 2);
  if (kept < best->model.map->features()) {
    Maybe fewer = search.refined(best->model, best->x0, best->model.map->alpha,
                                 {.degree = is_odd ? 2 * kept + 1 : kept + 1, .odd = is_odd});
    if (search.criterion(fewer) < search.criterion(best)) best = std::move(fewer);
  }
  if (!(search.criterion(best) < to_beat)) return {};
  if (degrees.hardening < 3) return best;
  Maybe one_sign = search.refined(best->model, best->x0, best->model.map->alpha,
                                  {.degree = degrees.hardening, .odd = true, .hardening = true});
  if (one_sign && one_sign->solution.cost <= (1 + kJudged.one_sign) * best->solution.cost) best = std::move(one_sign);
  return best;
}

}  // namespace wheelhop
