#include "variants/solver/secant_levenberg_marquardt.hpp"

#include <cmath>

#include "core/optimise/bounded_step.hpp"

namespace wheelhop {
namespace {

constexpr double kReturned = 10;  // damping, in steps that are then a fraction of those of steepest descent

class SecantLevenbergMarquardt final : public Solver {
 public:
  explicit SecantLevenbergMarquardt(const SecantLevenbergMarquardtOptions& options) : options_(options) {}
  std::string name() const override { return "secant_levenberg_marquardt"; }

 protected:
  Solution search(const ResidualProblem& problem, ConstVectorRef theta0, const Budget& budget) const override {
    const Index iterations = budget.iterations;
    Solution best;
    best.theta = theta0;
    Search search(problem, best.theta);
    if (!search.renew()) {
      best.status = Status::outside_domain;
      best.message = "the starting point lies outside the domain of the problem";
      return best;
    }
    best.status = Status::iteration_limit;
    best.message = "iteration limit reached";
    double damping = options_.initial_damping, growth = 2;
    for (best.iterations = 0; best.iterations < iterations;) {
      best.gradient_norm = search.scaled_gradient();
      if (best.gradient_norm < 1e-10 || search.cost == 0) {
        if (search.fresh || search.cost == 0 || options_.ending_share >= 1) {
          best.status = Status::ok;
          best.message = "gradient tolerance met";
          break;
        }
        search.renew_or_return(damping);
        continue;
      }
      double gain = 0, decrease = 0;
      bool accepted = false;
      while (!accepted && damping < kMostDamping) {
        accepted = search.try_step(damping, gain, decrease);
        if (accepted) {
          damping = std::max(damping * std::max(1.0 / 5, 1 - std::pow(2 * gain - 1, 3)), 1e-15);
          growth = 2;
        } else if (!search.fresh) {
          search.renew_or_return(damping);
        } else {
          damping *= growth;
          growth *= 2;
        }
      }
      if (!accepted) {
        best.status = Status::ok;
        best.message = "no step reduces the cost further (round-off level)";
        break;
      }
      ++best.iterations;
      if (decrease < options_.relative_decrease) {
        if (search.fresh_step || search.cost >= (1 - options_.ending_share) * search.cost_when_new) {
          best.status = Status::ok;
          best.message = "relative decrease below tolerance";
          break;
        }
        if (best.iterations < iterations) search.renew_or_return(damping);
      } else if (gain < options_.trusted_gain && best.iterations < iterations) {
        search.renew_or_return(damping);
      }
    }
    best.theta = search.theta;
    best.cost = search.cost;
    return best;
  }

 private:
  /// Where the search stands, with the Jacobian it believes in.
  struct Search {
    const ResidualProblem& problem;
    const Box box = problem.box();
    const BlockAngular layout = problem.layout();
    Vector theta, r, gradient, scale, where_new;
    Matrix J, H;  // J in its stored form
    double cost = 0, cost_when_new = 0;
    bool fresh = false;       // J belongs to theta
    bool fresh_step = false;  // the step before was made with such a J

    Search(const ResidualProblem& p, const Vector& start)
        : problem(p), theta(start), r(p.residuals()), J(p.residuals(), layout.stored()) {}

    bool renew() {
      if (!problem.stored_jacobian(theta, r, J)) return false;
      cost = cost_when_new = 0.5 * r.squaredNorm();
      where_new = theta;
      fresh = true;
      normal();
      return std::isfinite(cost);
    }

    /// Derivatives anew; where there are none, back to where there were, and on from there by shorter steps.
    void renew_or_return(double& damping) {
      if (renew()) return;
      const Vector here = theta;
      theta = where_new;
      damping = kReturned * std::max(damping, 1.0);
      if (renew()) return;
      theta = here;  // they are gone there too: the search ends where the cost was least
      fresh = true;
      damping = kMostDamping;
    }

    void normal() {
      gradient = layout.transposed_times(J, r);
      H = layout.lower_gram(J);
      scale = scale.size() == 0 ? Vector(H.diagonal()) : Vector(scale.cwiseMax(H.diagonal()));
    }

    double scaled_gradient() const {
      const Vector inside = projected_gradient(gradient, theta, box);
      double largest = 0;
      for (Index i = 0; i < inside.size(); ++i)
        if (H(i, i) > 0) largest = std::max(largest, std::abs(inside(i)) / std::sqrt(2 * H(i, i) * cost));
      return largest;
    }

    bool try_step(double damping, double& gain, double& decrease) {
      const Vector floor = scale.cwiseMax(1e-14 * scale.maxCoeff() + 1e-300);
      Matrix damped = H;
      damped.diagonal() += damping * floor;
      const Vector step = bounded_step(damped, gradient, theta, box);
      if (!step.allFinite()) return false;
      const double promised = -step.dot(gradient) - 0.5 * step.dot(H.selfadjointView<Eigen::Lower>() * step);
      Vector r_there(r.size());
      const Vector there = clamped(theta + step, box);
      if (!problem.residual(there, r_there)) return false;
      const double cost_there = 0.5 * r_there.squaredNorm();
      if (!(cost_there < cost)) return false;
      gain = (cost - cost_there) / std::max(promised, 1e-300);
      decrease = (cost - cost_there) / cost;
      // Broyden's update in the metric of the scaling: the least change of J that explains the step just made. A row
      // changes where it can differ from zero only (Schubert 1970, Math. Comp. 24:27).
      const Vector metric = floor.cwiseProduct(step);
      Vector missed = r_there - r;
      layout.subtract_times(J, step, missed);
      for (const RowBlock& block : layout.blocks()) {
        const Vector own_step = layout.of_group(step, block.group), own_metric = layout.of_group(metric, block.group);
        const double length = own_step.dot(own_metric);
        if (length > 0)
          J.middleRows(block.first, block.count).noalias() +=
              missed.segment(block.first, block.count) * (own_metric / length).transpose();
      }
      theta = there;
      r = std::move(r_there);
      cost = cost_there;
      fresh_step = fresh;
      fresh = false;
      normal();
      return true;
    }
  };

  SecantLevenbergMarquardtOptions options_;
};

}  // namespace

std::unique_ptr<Solver> make_secant_levenberg_marquardt(const SecantLevenbergMarquardtOptions& options) {
  return std::make_unique<SecantLevenbergMarquardt>(options);
}

}  // namespace wheelhop
