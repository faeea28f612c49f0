#include "core/identify/map_fit.hpp"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include "core/optimise/bounded_step.hpp"

namespace wheelhop {
namespace {

/// [1 xi'], N x (1 + d).
Matrix ones_and(ConstMatrixRef xi) {
  Matrix columns(xi.cols(), 1 + xi.rows());
  columns << Vector::Ones(xi.cols()), xi.transpose();
  return columns;
}

Matrix orthonormal_basis(ConstMatrixRef columns) {
  const Eigen::ColPivHouseholderQR<Matrix> qr(columns);
  return qr.householderQ() * Matrix::Identity(columns.rows(), qr.rank());
}

/// (I - Q Q') M.
Matrix rest(ConstMatrixRef Q, ConstMatrixRef M) { return M - Q * (Q.transpose() * M); }

/// W, b and L of `map` and the linear part from rows of phi, of [1 xi] and of f, or from those of the triangular factor
/// of all three. @return the relative residual
double solve_weights(ConstMatrixRef phi, ConstMatrixRef affine, ConstMatrixRef f, StaticMap& map, Matrix& linear) {
  constexpr double tolerance = 1e-11;
  const Index h = phi.cols(), q = f.cols(), d = affine.cols() - 1;
  Matrix columns(phi.rows(), h + 1 + d);
  columns << phi, affine;
  LeastSquares fit = least_squares(columns, f, tolerance);
  if (const Vector least = map.lower(); least.size() > 0) {
    const Matrix Q = orthonormal_basis(affine);
    const Matrix curved = rest(Q, phi), curved_f = rest(Q, f);
    for (Index i = 0; i < q; ++i)
      fit.x.col(i).head(h) = bounded_least_squares(curved, curved_f.col(i),
                                                   {least(Eigen::seqN(map.alpha.size() + i, h, q)),
                                                    Vector::Constant(h, std::numeric_limits<double>::infinity())});
    const LeastSquares of_rest = least_squares(affine, f - phi * fit.x.topRows(h), tolerance);
    fit.x.bottomRows(d + 1) = of_rest.x;
    fit.residual_norm = of_rest.residual_norm;
  }
  map.W = fit.x.topRows(h).transpose();
  // What W phi has in common with [1, xi] moves to the linear part. Tanh units of small weight are almost linear, and
  // without this split W phi and the linear part may be huge and cancel.
  const LeastSquares common = least_squares(affine, phi * fit.x.topRows(h), tolerance);
  map.b = fit.x.row(h).transpose();
  map.L = -common.x.bottomRows(d).transpose();
  linear = (fit.x.bottomRows(d) + common.x.bottomRows(d)).transpose();
  return fit.residual_norm / std::max(f.norm(), 1e-300);
}

/// What the constant and xi explain is projected out once, before any alpha: of the regressors [phi 1 xi] only phi
/// changes (Frisch & Waugh 1933).
class MapProblem final : public ResidualProblem {
 public:
  MapProblem(const StaticMap& prototype, ConstMatrixRef xi, ConstMatrixRef f)
      : map_(prototype.clone()), xi_(xi), f_(f.transpose()) {
    affine_ = orthonormal_basis(ones_and(xi));
    curved_f_ = rest(affine_, f_);
  }

  Index parameters() const override { return map_->inner_parameters(); }
  Index residuals() const override { return f_.size(); }

  bool residual(ConstVectorRef alpha, VectorRef r) const override {
    const Eigen::HouseholderQR<Matrix> qr(rest(affine_, features(alpha)));
    Matrix both = curved_f_;
    both.applyOnTheLeft(qr.householderQ().adjoint());
    both.topRows(std::min(map_->features(), both.rows())).setZero();
    both.applyOnTheLeft(qr.householderQ());
    r = both.reshaped();
    return r.allFinite();
  }

  /// From the triangle of the QR of [phi f]; a trial step needs no residual.
  bool cost(ConstVectorRef alpha, double& cost) const override {
    const Index h = map_->features(), q = f_.cols();
    if (f_.rows() < h + q) return ResidualProblem::cost(alpha, cost);
    Matrix both(f_.rows(), h + q);
    both << rest(affine_, features(alpha)), curved_f_;
    const Eigen::HouseholderQR<Matrix> qr(both);
    const Matrix R = qr.matrixQR().block(h, h, q, q).triangularView<Eigen::Upper>();
    cost = 0.5 * R.squaredNorm();
    return std::isfinite(cost);
  }

  bool jacobian(ConstVectorRef alpha, VectorRef r, MatrixRef J) const override {
    const Index N = xi_.cols();
    const Slopes at = slopes(alpha);
    r = at.r.reshaped();
    for (Index i = 0; i < f_.cols(); ++i) J.middleRows(i * N, N) = rest(at.Q, at.change[static_cast<std::size_t>(i)]);
    return r.allFinite();
  }

  bool normal_equations(ConstVectorRef alpha, double& cost, Vector& gradient, Matrix& gauss_newton) const override {
    const Slopes at = slopes(alpha);
    cost = 0.5 * at.r.squaredNorm();
    gradient.setZero(parameters());
    gauss_newton.setZero(parameters(), parameters());
    for (Index i = 0; i < f_.cols(); ++i) {
      const Matrix& M = at.change[static_cast<std::size_t>(i)];
      const Matrix QM = at.Q.transpose() * M;
      gradient.noalias() += M.transpose() * at.r.col(i);  // r is orthogonal to Q already
      gauss_newton.selfadjointView<Eigen::Lower>().rankUpdate(M.transpose());
      gauss_newton.selfadjointView<Eigen::Lower>().rankUpdate(QM.transpose(), -1);
    }
    return std::isfinite(cost);
  }

  /// W, b and the linear part for a given alpha; returns the relative residual.
  double weights(ConstVectorRef alpha, StaticMap& map, Matrix& linear) const {
    map.alpha = alpha;
    return solve_weights(features(alpha), ones_and(xi_), f_, map, linear);
  }

 private:
  /// Kaufman: dr = -(I - Q Q') dPhi W; the neglected term is orthogonal to r, so the gradient is exact.
  struct Slopes {
    Matrix Q;                    // N x (h + 1 + d), orthonormal basis of the linear columns
    Matrix r;                    // N x q
    std::vector<Matrix> change;  // -dPhi W an output, N x (number of alpha), not yet projected
  };

  Slopes slopes(ConstVectorRef alpha) const {
    const Index N = xi_.cols(), h = map_->features(), q = f_.cols();
    const Matrix phi = features(alpha);
    const Eigen::ColPivHouseholderQR<Matrix> qr(rest(affine_, phi));
    const Matrix weights = qr.solve(curved_f_);  // h x q
    Slopes at;
    at.Q.resize(N, affine_.cols() + h);
    at.Q << affine_, qr.householderQ() * Matrix::Identity(N, h);
    at.r = rest(at.Q.rightCols(h), curved_f_);
    at.change.reserve(static_cast<std::size_t>(q));
    for (Index i = 0; i < q; ++i) at.change.push_back(map_->alpha_slopes(xi_, phi, -weights.col(i)));
    return at;
  }

  Matrix features(ConstVectorRef alpha) const {
    map_->alpha = alpha;
    return map_->basis_of(xi_);
  }

  std::unique_ptr<StaticMap> map_;  // scratch for alpha; W and b are not used here
  Matrix xi_;
  Matrix f_;         // N x q
  Matrix affine_;    // N x (1 + d) or less, orthonormal basis of [1 xi]
  Matrix curved_f_;  // f without what [1 xi] explains
};

}  // namespace

std::vector<Index> chosen_samples(ConstMatrixRef f, Index limit) {
  const Index N = f.cols();
  std::vector<Index> chosen(static_cast<std::size_t>(N));
  std::iota(chosen.begin(), chosen.end(), Index{0});
  if (N <= limit) return chosen;
  const Vector size = f.colwise().squaredNorm();
  const Index extremes = limit / 4, step = (N + limit - extremes - 1) / (limit - extremes);
  const auto last = chosen.begin() + extremes;
  std::nth_element(chosen.begin(), last, chosen.end(),
                   [&](Index a, Index b) { return size(a) > size(b) || (size(a) == size(b) && a < b); });
  chosen.erase(last, chosen.end());
  for (Index k = 0; k < N; k += step) chosen.push_back(k);
  std::sort(chosen.begin(), chosen.end());
  chosen.erase(std::unique(chosen.begin(), chosen.end()), chosen.end());
  return chosen;
}

std::unique_ptr<ResidualProblem> map_problem(const StaticMap& prototype, ConstMatrixRef xi, ConstMatrixRef f) {
  return std::make_unique<MapProblem>(prototype, xi, f);
}

WeightFit::WeightFit(const StaticMap& map)
    : map_(map), stream_(1 + map.inputs() + map.features() + map.outputs(), 512) {}

void WeightFit::add(ConstMatrixRef xi, ConstMatrixRef f) {
  const Index affine = 1 + xi.rows(), h = map_.features();
  for (Index first = 0; first < xi.cols();) {
    const Index count = std::min(stream_.capacity(), xi.cols() - first);
    const auto points = xi.middleCols(first, count);
    MatrixRef rows = stream_.next(count);
    rows.leftCols(affine) = ones_and(points);
    rows.middleCols(affine, h) = map_.basis_of(points);
    rows.rightCols(f.rows()) = f.middleCols(first, count).transpose();
    first += count;
  }
}

MapFit WeightFit::finish(double sign) {
  if (factor_.size() == 0) factor_ = stream_.finish();
  const Index affine = 1 + map_.inputs(), h = map_.features();
  MapFit fit;
  fit.map = map_.clone();
  fit.residual = solve_weights(factor_.middleCols(affine, h), factor_.leftCols(affine),
                               sign * factor_.rightCols(map_.outputs()), *fit.map, fit.linear);
  if (std::isfinite(fit.residual))
    fit.status = Status::ok;
  else
    fit.message = "the weights of the static map are not finite";
  return fit;
}

MapFit fit_weights(const StaticMap& map, ConstMatrixRef xi, ConstMatrixRef f) {
  WeightFit fit(map);
  fit.add(xi, f);
  return fit.finish();
}

MapFit fit_static_map(const StaticMap& prototype, ConstMatrixRef xi, ConstMatrixRef f, const MapFitOptions& options,
                      const Solver& solver, Random& random) {
  MapFit best;
  best.residual = std::numeric_limits<double>::infinity();
  const std::vector<Index> chosen = chosen_samples(f, options.samples);
  const Index unknowns = prototype.features() + 1 + xi.rows();
  if (static_cast<Index>(chosen.size()) < unknowns + f.rows()) {
    best.status = Status::rank_deficient;
    best.message = fmt::format("{} samples are too few for a map with {} weights an output", chosen.size(), unknowns);
    return best;
  }
  const Matrix points = xi(Eigen::all, chosen), targets = f(Eigen::all, chosen);
  const MapProblem problem(prototype, points, targets);
  // Without inner parameters every start would be the same.
  const Index starts = problem.parameters() > 0 ? options.starts : 1;
  for (Index start = 0; start < starts; ++start) {
    std::unique_ptr<StaticMap> map = prototype.clone();
    map->initialise(points, targets, random);
    Vector alpha = map->alpha;
    if (problem.parameters() > 0) {
      const Solution solution = solver.minimise(problem, alpha, options.budget);
      if (solution.status != Status::ok && solution.status != Status::iteration_limit) continue;
      if (!solution.theta.allFinite()) continue;
      alpha = solution.theta;
    }
    Matrix linear;
    const double residual = problem.weights(alpha, *map, linear);
    if (!(residual < best.residual)) continue;
    best.residual = residual;
    best.linear = linear;
    best.map = std::move(map);
  }
  if (!best.map || !std::isfinite(best.residual)) {
    best.message = "no start of the static map's fit gave a finite residual";
    return best;
  }
  best.status = Status::ok;
  return best;
}

}  // namespace wheelhop
