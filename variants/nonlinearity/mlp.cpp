#include "variants/nonlinearity/mlp.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace wheelhop {
namespace {

constexpr Index kLanes = 8;

/// By the exponential, which Eigen vectorises: the library's tanh took a sixth of a whole identification.
template <class Values>
auto hyperbolic_tangent(const Values& values) {
  return 1 - 2 / ((2 * values).exp() + 1);
}

/// alpha = [w_1; c_1; w_2; c_2; ...], d + 1 values a unit.
class Mlp final : public StaticMap {
 public:
  Mlp(Index inputs, Index outputs, const MlpOptions& options)
      : StaticMap(inputs, outputs, options.hidden_units, options.hidden_units * (inputs + 1)), options_(options) {}

  std::unique_ptr<StaticMap> clone() const override { return std::make_unique<Mlp>(*this); }
  std::string name() const override { return "mlp"; }

  void initialise(ConstMatrixRef /*xi*/, ConstMatrixRef /*f*/, Random& random) override {
    // Weights of modulus ~1 bend within the data's unit variance; offsets of +-1.5 spread the bends over the range.
    const Index d = inputs();
    for (Index i = 0; i < features(); ++i) {
      for (Index j = 0; j < d; ++j) alpha(i * (d + 1) + j) = random.normal() / std::sqrt(static_cast<double>(d));
      alpha(i * (d + 1) + d) = 3 * random.uniform() - 1.5;
    }
  }

  std::unique_ptr<StaticMap> widened(Index more, Random& random) const override {
    MlpOptions wider = options_;
    wider.hidden_units += more;
    if (wider.hidden_units > kMostUnits) return nullptr;
    auto map = std::make_unique<Mlp>(inputs(), outputs(), wider);
    map->initialise(Matrix(), Matrix(), random);
    map->alpha.head(alpha.size()) = alpha;
    // Weights of zero would leave the new units without slopes, and a fit nowhere to go.
    constexpr double faint = 1e-3;
    const double size = faint * W.norm() / std::sqrt(static_cast<double>(std::max<Index>(1, W.size())));
    map->W << W, size * random.normal(outputs(), more);
    map->b = b;
    map->L = L;
    return map;
  }

  /// On the slopes alone: an offset says where a unit bends, not how sharply.
  Vector precision() const override {
    Vector all = Vector::Zero(parameters());
    for (Index i = 0; i < features(); ++i)
      all.segment(i * (inputs() + 1), inputs()).setConstant(1 / (options_.slope_std * options_.slope_std));
    return all;
  }

  void basis(const double* xi, double* phi) const override {
    const Index d = inputs(), h = features();
    const double* w = alpha.data();
    for (Index first = 0; first < h; first += kLanes) {
      const Index count = std::min(kLanes, h - first);
      Eigen::Array<double, kLanes, 1> sum = Eigen::Array<double, kLanes, 1>::Zero();
      for (Index i = 0; i < count; ++i, w += d + 1) {
        sum(i) = w[d];
        for (Index j = 0; j < d; ++j) sum(i) += w[j] * xi[j];
      }
      sum = hyperbolic_tangent(sum).eval();
      std::copy_n(sum.data(), count, phi + first);
    }
  }

  void slopes(const double* xi, const double* phi, const double* w, double* dxi, double* dalpha) const override {
    const Index d = inputs();
    std::fill(dxi, dxi + d, 0.0);
    const double* inner = alpha.data();
    for (Index i = 0; i < features(); ++i, inner += d + 1, dalpha += d + 1) {
      const double slope = w[i] * (1 - phi[i] * phi[i]);
      for (Index j = 0; j < d; ++j) {
        dxi[j] += slope * inner[j];
        dalpha[j] = slope * xi[j];
      }
      dalpha[d] = slope;
    }
  }

  Matrix basis_of(ConstMatrixRef xi) const override {
    const auto inner = alpha.reshaped(inputs() + 1, features());
    Matrix phi = xi.transpose() * inner.topRows(inputs());
    phi.rowwise() += inner.row(inputs());
    return hyperbolic_tangent(phi.array());
  }

  Matrix alpha_slopes(ConstMatrixRef xi, ConstMatrixRef phi, ConstVectorRef w) const override {
    const Index d = inputs();
    const Matrix points = xi.transpose();
    Matrix slopes(xi.cols(), alpha.size());
    for (Index i = 0; i < features(); ++i) {
      auto own = slopes.middleCols(i * (d + 1), d + 1);
      own.col(d) = w(i) * (1 - phi.col(i).array().square());
      own.leftCols(d) = own.col(d).asDiagonal() * points;
    }
    return slopes;
  }

 private:
  Json options() const override { return write_options(options_); }

  MlpOptions options_;
};

}  // namespace

std::unique_ptr<StaticMap> make_mlp(Index inputs, Index outputs, const MlpOptions& options) {
  return std::make_unique<Mlp>(inputs, outputs, options);
}

}  // namespace wheelhop
