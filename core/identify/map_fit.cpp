#include "core/identify/map_fit.hpp"

#include <Eigen/QR>
#include <cmath>
#include <vector>

namespace wheelhop {
namespace {

/// Every `step`-th column, at most `limit` of them.
Matrix thinned(ConstMatrixRef M, Index limit) {
  const Index step = std::max<Index>(1, (M.cols() + limit - 1) / limit), count = (M.cols() + step - 1) / step;
  Matrix out(M.rows(), count);
  for (Index k = 0; k < count; ++k) out.col(k) = M.col(k * step);
  return out;
}

class MapProblem final : public ResidualProblem {
 public:
  MapProblem(const StaticMap& prototype, ConstMatrixRef xi, ConstMatrixRef f)
      : map_(prototype.clone()), xi_(xi), f_(f.transpose()) {}

  Index parameters() const override { return map_->inner_parameters(); }
  Index residuals() const override { return f_.size(); }

  bool residual(ConstVectorRef alpha, VectorRef r) const override {
    const Matrix columns = regressors(alpha);
    const Eigen::HouseholderQR<Matrix> qr(columns);
    r = rest(qr, columns.cols(), f_).reshaped();
    return r.allFinite();
  }

  bool jacobian(ConstVectorRef alpha, VectorRef r, MatrixRef J) const override {
    const Index N = xi_.cols();
    const Slopes at = slopes(alpha);
    r = at.r.reshaped();
    for (Index i = 0; i < f_.cols(); ++i)
      J.middleRows(i * N, N) =
          at.change[static_cast<std::size_t>(i)] - at.Q * (at.Q.transpose() * at.change[static_cast<std::size_t>(i)]);
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
    const Matrix columns = regressors(alpha);
    const LeastSquares fit = least_squares(columns, f_, 1e-11);
    const Index h = map_->features(), d = xi_.rows();
    map.alpha = alpha;
    map.W = fit.x.topRows(h).transpose();
    // What W phi has in common with [1, xi] moves to the linear part. Tanh units of small weight are almost linear, and
    // without this split W phi and the linear part may be huge and cancel.
    const LeastSquares common = least_squares(columns.rightCols(d + 1), columns.leftCols(h) * fit.x.topRows(h), 1e-11);
    map.b = fit.x.row(h).transpose();
    map.L = -common.x.bottomRows(d).transpose();
    linear = (fit.x.bottomRows(d) + common.x.bottomRows(d)).transpose();
    return fit.residual_norm / std::max(f_.norm(), 1e-300);
  }

 private:
  /// Kaufman: dr = -(I - Q Q') dPhi W; the neglected term is orthogonal to r, so the gradient is exact.
  struct Slopes {
    Matrix Q;                    // N x (h + 1 + d), orthonormal basis of the linear columns
    Matrix r;                    // N x q
    std::vector<Matrix> change;  // -dPhi W an output, N x (number of alpha), not yet projected
  };

  Slopes slopes(ConstVectorRef alpha) const {
    const Index N = xi_.cols(), h = map_->features(), inner = parameters(), q = f_.cols();
    const Matrix columns = regressors(alpha);
    const Eigen::ColPivHouseholderQR<Matrix> qr(columns);
    const Matrix weights = qr.solve(f_);  // (h + 1 + d) x q
    Slopes at;
    at.Q = qr.householderQ() * Matrix::Identity(N, columns.cols());
    at.r = f_ - at.Q * (at.Q.transpose() * f_);
    at.change.assign(static_cast<std::size_t>(q), Matrix(N, inner));
    Vector phi(h), w(h), dxi(xi_.rows());
    Matrix transposed(inner, N);
    for (Index i = 0; i < q; ++i) {
      w = -weights.col(i).head(h);
      for (Index k = 0; k < N; ++k) {
        phi = columns.row(k).head(h);
        map_->slopes(xi_.col(k).data(), phi.data(), w.data(), dxi.data(), transposed.col(k).data());
      }
      at.change[static_cast<std::size_t>(i)] = transposed.transpose();
    }
    return at;
  }

  /// [phi 1 xi], N x (h + 1 + d).
  Matrix regressors(ConstVectorRef alpha) const {
    map_->alpha = alpha;
    const Index N = xi_.cols(), h = map_->features(), d = xi_.rows();
    Matrix columns(N, h + 1 + d);
    Vector phi(h);
    for (Index k = 0; k < N; ++k) {
      map_->basis(xi_.col(k).data(), phi.data());
      columns.row(k).head(h) = phi;
    }
    columns.col(h).setOnes();
    columns.rightCols(d) = xi_.transpose();
    return columns;
  }

  /// (I - Q Q') M.
  static Matrix rest(const Eigen::HouseholderQR<Matrix>& qr, Index width, Matrix M) {
    M.applyOnTheLeft(qr.householderQ().adjoint());
    M.topRows(width).setZero();
    M.applyOnTheLeft(qr.householderQ());
    return M;
  }

  std::unique_ptr<StaticMap> map_;  // scratch for alpha; W and b are not used here
  Matrix xi_;
  Matrix f_;  // N x q
};

}  // namespace

std::unique_ptr<ResidualProblem> map_problem(const StaticMap& prototype, ConstMatrixRef xi, ConstMatrixRef f) {
  return std::make_unique<MapProblem>(prototype, xi, f);
}

MapFit fit_static_map(const StaticMap& prototype, ConstMatrixRef xi, ConstMatrixRef f, const MapFitOptions& options,
                      const Solver& solver, Random& random) {
  MapFit best;
  best.residual = std::numeric_limits<double>::infinity();
  const MapProblem problem(prototype, thinned(xi, options.samples), thinned(f, options.samples));
  for (Index start = 0; start < options.starts; ++start) {
    std::unique_ptr<StaticMap> map = prototype.clone();
    map->initialise(random);
    Vector alpha = map->alpha;
    if (problem.parameters() > 0) {
      const Solution solution = solver.minimise(problem, alpha, options.iterations);
      if (solution.status == Status::outside_domain || !solution.theta.allFinite()) continue;
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
