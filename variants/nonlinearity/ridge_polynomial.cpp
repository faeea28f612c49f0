#include "variants/nonlinearity/ridge_polynomial.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>

namespace wheelhop {
namespace {

/// A power beyond it would outgrow what a sampled model can follow: its slope exceeds that of a stable free run.
constexpr double kReach = 1.5;

class RidgePolynomial final : public StaticMap {
 public:
  RidgePolynomial(Index inputs, Index outputs, const RidgePolynomialOptions& options)
      : StaticMap(inputs, outputs, options.odd ? (options.degree - 1) / 2 : options.degree - 1, inputs),
        options_(options) {}

  std::unique_ptr<StaticMap> clone() const override { return std::make_unique<RidgePolynomial>(*this); }
  std::string name() const override { return "ridge_polynomial"; }

  void initialise(ConstMatrixRef /*xi*/, ConstMatrixRef /*f*/, Random& random) override {
    // Points of unit variance reach three standard deviations along a direction of length 1.
    for (Index j = 0; j < inputs(); ++j) alpha(j) = random.normal();
    alpha /= 3 * std::max(alpha.norm(), 1e-9);
  }

  Vector lower() const override {
    if (!options_.hardening) return {};
    Vector least = Vector::Constant(parameters(), -std::numeric_limits<double>::infinity());
    least.segment(alpha.size(), W.size()).setZero();
    return least;
  }

  void basis(const double* xi, double* phi) const override {
    visit_terms(along(xi), [&](Index i, double value, double) { phi[i] = value; });
  }

  void slopes(const double* xi, const double* /*phi*/, const double* w, double* dxi, double* dalpha) const override {
    double slope = 0;
    visit_terms(along(xi), [&](Index i, double, double rate) { slope += w[i] * rate; });
    for (Index j = 0; j < inputs(); ++j) {
      dxi[j] = slope * alpha(j);
      dalpha[j] = slope * xi[j];
    }
  }

 private:
  Json options() const override { return write_options(options_); }

  double along(const double* xi) const {
    double sum = 0;
    for (Index j = 0; j < inputs(); ++j) sum += alpha(j) * xi[j];
    return sum;
  }

  /// Calls receive(i, phi_i, dphi_i/ds) by p_{k+1} = c s p_k - (c - 1) p_{k-1} and its derivative: T_k with c = 2,
  /// s^k with c = 1.
  template <class Receive>
  void visit_terms(double s, const Receive& receive) const {
    const double inside = std::clamp(s, -kReach, kReach), c = options_.hardening ? 1 : 2;
    double before = 1, value = inside, rate_before = 0, rate = 1;
    for (Index k = 2, i = 0; k <= options_.degree; ++k) {
      const double next = c * inside * value - (c - 1) * before;
      const double next_rate = c * (value + inside * rate) - (c - 1) * rate_before;
      before = value;
      value = next;
      rate_before = rate;
      rate = next_rate;
      if (!options_.odd || k % 2 == 1) receive(i++, value + rate * (s - inside), rate);
    }
  }

  RidgePolynomialOptions options_;
};

}  // namespace

std::unique_ptr<StaticMap> make_ridge_polynomial(Index inputs, Index outputs, const RidgePolynomialOptions& options) {
  return std::make_unique<RidgePolynomial>(inputs, outputs, options);
}

}  // namespace wheelhop
