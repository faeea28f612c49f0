#include "core/optimise/prior.hpp"

#include <cmath>

namespace wheelhop {
namespace {

class WithPrior final : public ResidualProblem {
 public:
  WithPrior(const ResidualProblem& problem, ConstVectorRef mean, ConstVectorRef precision)
      : problem_(problem), mean_(mean), precision_(precision) {}

  Index parameters() const override { return problem_.parameters(); }
  Index residuals() const override { return problem_.residuals() + parameters(); }
  Box box() const override { return problem_.box(); }

  /// A row of the prior has one number: those of the common parameters count to the last group, the others to their
  /// own.
  BlockAngular layout() const override {
    const BlockAngular of = problem_.layout();
    std::vector<RowBlock> blocks = of.blocks();
    Index first = problem_.residuals();
    blocks.push_back({first, of.common(), of.groups() - 1});
    first += of.common();
    for (Index group = 0; group < of.groups(); ++group, first += of.own()) blocks.push_back({first, of.own(), group});
    return {of.common(), of.own(), of.groups(), blocks};
  }

  bool residual(ConstVectorRef theta, VectorRef r) const override {
    r.tail(parameters()) = prior_residual(theta);
    return problem_.residual(theta, r.head(problem_.residuals()));
  }

  bool jacobian(ConstVectorRef theta, VectorRef r, MatrixRef J) const override {
    r.tail(parameters()) = prior_residual(theta);
    J.bottomRows(parameters()) = precision_.cwiseSqrt().asDiagonal();
    return problem_.jacobian(theta, r.head(problem_.residuals()), J.topRows(problem_.residuals()));
  }

  bool stored_jacobian(ConstVectorRef theta, VectorRef r, MatrixRef J) const override {
    const BlockAngular of = problem_.layout();
    r.tail(parameters()) = prior_residual(theta);
    auto own = J.bottomRows(parameters());
    own.setZero();
    for (Index i = 0; i < parameters(); ++i)
      own(i, i < of.common() ? i : of.common() + (i - of.common()) % of.own()) = std::sqrt(precision_(i));
    return problem_.stored_jacobian(theta, r.head(problem_.residuals()), J.topRows(problem_.residuals()));
  }

  bool cost(ConstVectorRef theta, double& cost) const override {
    if (!problem_.cost(theta, cost)) return false;
    cost += 0.5 * prior_residual(theta).squaredNorm();
    return true;
  }

  bool normal_equations(ConstVectorRef theta, double& cost, Vector& gradient, Matrix& gauss_newton) const override {
    if (!problem_.normal_equations(theta, cost, gradient, gauss_newton)) return false;
    cost += 0.5 * prior_residual(theta).squaredNorm();
    gradient += precision_.cwiseProduct(theta - mean_);
    gauss_newton.diagonal() += precision_;
    return true;
  }

 private:
  Vector prior_residual(ConstVectorRef theta) const { return precision_.cwiseSqrt().cwiseProduct(theta - mean_); }

  const ResidualProblem& problem_;
  Vector mean_, precision_;
};

}  // namespace

std::unique_ptr<ResidualProblem> with_prior(const ResidualProblem& problem, ConstVectorRef mean,
                                            ConstVectorRef precision) {
  return std::make_unique<WithPrior>(problem, mean, precision);
}

double residual_variance(const ResidualProblem& problem, ConstVectorRef theta) {
  double cost = 0;
  if (!problem.cost(theta, cost) || !std::isfinite(cost)) return 0;
  return 2 * cost / static_cast<double>(problem.residuals());
}

}  // namespace wheelhop
