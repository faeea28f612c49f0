#include "variants/nonlinearity/rbf.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "core/identify/map_fit.hpp"
#include "core/identify/ridge.hpp"
#include "variants/nonlinearity/polynomial.hpp"

namespace wheelhop {
namespace {

constexpr int kMeansRounds = 30;      // Lloyd's iteration on a few thousand points settles in a dozen
constexpr double kSpread = 0.1;       // of the starting directions, so that starts differ
constexpr double kLeastWidth = 1e-3;  // of a start, in standard deviations

/// Columns of the centres that k-means finds in t (r x N). @param count <= N
Matrix k_means(const Matrix& t, Index count, Random& random) {
  const Index N = t.cols();
  Matrix centres(t.rows(), count);
  Vector nearest = Vector::Constant(N, std::numeric_limits<double>::infinity());
  for (Index i = 0; i < count; ++i) {  // the next start: a point, with its squared distance as weight
    Index chosen = random.integer(N);
    if (const double total = nearest.sum(); i > 0 && total > 0) {
      double left = random.uniform() * total;
      for (chosen = 0; chosen + 1 < N && (left -= nearest(chosen)) > 0;) ++chosen;
    }
    centres.col(i) = t.col(chosen);
    nearest = nearest.cwiseMin((t.colwise() - Vector(centres.col(i))).colwise().squaredNorm().transpose());
  }
  std::vector<Index> owner(static_cast<std::size_t>(N), -1);
  for (int round = 0; round < kMeansRounds; ++round) {
    bool changed = false;
    Matrix sums = Matrix::Zero(t.rows(), count);
    Vector members = Vector::Zero(count);
    for (Index k = 0; k < N; ++k) {
      Index best = 0;
      (centres.colwise() - Vector(t.col(k))).colwise().squaredNorm().minCoeff(&best);
      changed = changed || std::exchange(owner[static_cast<std::size_t>(k)], best) != best;
      sums.col(best) += t.col(k);
      members(best) += 1;
    }
    if (!changed) break;
    for (Index i = 0; i < count; ++i)
      if (members(i) > 0) centres.col(i) = sums.col(i) / members(i);
  }
  return centres;
}

/// alpha = [P column-major (r x d, none if isotropic); centres (r x h); log widths (h)].
class Rbf final : public StaticMap {
 public:
  Rbf(Index inputs, Index outputs, const RbfOptions& options)
      : StaticMap(inputs, outputs, options.hidden_units,
                  options.directions * inputs +
                      options.hidden_units * ((options.directions > 0 ? options.directions : inputs) + 1)),
        options_(options) {}

  std::unique_ptr<StaticMap> clone() const override { return std::make_unique<Rbf>(*this); }
  std::string name() const override { return "rbf"; }

  void initialise(ConstMatrixRef xi, ConstMatrixRef f, Random& random) override {
    const Index r = seen(), h = features();
    if (learned()) {
      Matrix P = directions(xi, f) + kSpread * random.normal(r, inputs());
      const Vector size = (P * xi).rowwise().norm() / std::sqrt(static_cast<double>(xi.cols()));
      P = size.cwiseMax(1e-300).cwiseInverse().asDiagonal() * P;
      alpha.head(P.size()) = P.reshaped();
    }
    const Matrix t = projected(xi), centres = k_means(t, h, random);
    alpha.segment(at_centres(), r * h) = centres.reshaped();
    for (Index i = 0; i < h; ++i) {
      Vector distance = (centres.colwise() - Vector(centres.col(i))).colwise().norm().transpose();
      std::sort(distance.begin(), distance.end());  // the first is the centre itself
      const Index near = std::min<Index>(2 * r, h - 1);
      const double width = near > 0 ? distance.segment(1, near).mean() : 1;
      alpha(at_widths() + i) = std::log(std::max(width, kLeastWidth));
    }
  }

  Vector precision() const override {
    Vector all = Vector::Zero(parameters());
    all.segment(at_widths(), features()).setConstant(1 / (options_.width_std * options_.width_std));
    return all;
  }

  void basis(const double* xi, double* phi) const override {
    const Vector t = projected(point(xi));
    for (Index i = 0; i < features(); ++i) phi[i] = std::exp(-0.5 * (t - centre(i)).squaredNorm() * inverse_square(i));
  }

  void slopes(const double* xi, const double* phi, const double* w, double* dxi, double* dalpha) const override {
    const Index r = seen(), d = inputs();
    const Vector t = projected(point(xi));
    Vector by_t = Vector::Zero(r);
    double *by_centre = dalpha + at_centres(), *by_width = dalpha + at_widths();
    for (Index i = 0; i < features(); ++i) {
      const Vector away = t - centre(i);
      const double rate = w[i] * phi[i] * inverse_square(i);
      Eigen::Map<Vector>(by_centre + i * r, r) = rate * away;
      by_t -= rate * away;
      by_width[i] = rate * away.squaredNorm();
    }
    Eigen::Map<Vector> by_point(dxi, d);
    if (!learned()) {
      by_point = by_t;
      return;
    }
    by_point = directions_matrix().transpose() * by_t;
    Eigen::Map<Matrix>(dalpha, r, d) = by_t * point(xi).transpose();
  }

 private:
  Json options() const override { return write_options(options_); }

  bool learned() const { return options_.directions > 0; }
  Index seen() const { return learned() ? options_.directions : inputs(); }
  Index at_centres() const { return options_.directions * inputs(); }
  Index at_widths() const { return at_centres() + seen() * features(); }
  Eigen::Map<const Vector> point(const double* xi) const { return {xi, inputs()}; }
  Eigen::Map<const Matrix> directions_matrix() const { return {alpha.data(), options_.directions, inputs()}; }
  Eigen::Map<const Vector> centre(Index i) const { return {alpha.data() + at_centres() + i * seen(), seen()}; }
  double inverse_square(Index i) const { return std::exp(-2 * alpha(at_widths() + i)); }
  Matrix projected(ConstMatrixRef xi) const { return learned() ? Matrix(directions_matrix() * xi) : Matrix(xi); }

  /// Where a polynomial fit of f bends most, r x d; any unit directions where the points are too few for one.
  Matrix directions(ConstMatrixRef xi, ConstMatrixRef f) const {
    const Index r = std::min(seen(), inputs());
    Matrix found = Matrix::Zero(seen(), inputs());
    found.topRows(r).setIdentity();
    for (const Index degree : {3, 2}) {
      if (4 * polynomial_terms(inputs(), {.degree = degree}) > static_cast<double>(xi.cols())) continue;
      const MapFit fit = fit_weights(*make_polynomial(inputs(), f.rows(), {.degree = degree}), xi, f);
      if (fit.status != Status::ok) continue;
      found.topRows(r) = active_subspace(*fit.map, xi).vectors.rightCols(r).transpose();
      break;
    }
    return found;
  }

  RbfOptions options_;
};

}  // namespace

std::unique_ptr<StaticMap> make_rbf(Index inputs, Index outputs, const RbfOptions& options) {
  return std::make_unique<Rbf>(inputs, outputs, options);
}

}  // namespace wheelhop
