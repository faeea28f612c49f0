#include "variants/solver/levenberg_marquardt.hpp"

#include <cmath>

#include "core/optimise/bounded_step.hpp"

namespace wheelhop {
namespace {

class LevenbergMarquardt final : public Solver {
 public:
  explicit LevenbergMarquardt(const LevenbergMarquardtOptions& options) : options_(options) {}
  std::string name() const override { return "levenberg_marquardt"; }

 protected:
  Solution search(const ResidualProblem& problem, ConstVectorRef theta0, const Budget& budget) const override {
    const Index iterations = budget.iterations;
    Solution best;
    best.theta = theta0;
    Vector gradient;
    Matrix H;
    if (!problem.normal_equations(best.theta, best.cost, gradient, H) || !std::isfinite(best.cost)) {
      best.status = Status::outside_domain;
      best.message = "the starting point lies outside the domain of the problem";
      return best;
    }
    best.status = Status::iteration_limit;
    double damping = options_.initial_damping, growth = 2;
    Index small_steps = 0;
    const Box box = problem.box();
    Vector scale = Vector::Zero(problem.parameters());
    for (best.iterations = 0; best.iterations < iterations; ++best.iterations) {
      // A parameter without influence has a zero column; a floor keeps its equation solvable (its step is then 0).
      scale = scale.cwiseMax(H.diagonal());
      const Vector floor = scale.cwiseMax(1e-14 * scale.maxCoeff() + 1e-300);
      best.gradient_norm = scaled_gradient(projected_gradient(gradient, best.theta, box), H.diagonal(), best.cost);
      if (best.gradient_norm < 1e-10 || best.cost == 0) {
        best.status = Status::ok;
        best.message = "gradient tolerance met";
        return best;
      }
      bool accepted = false;
      while (!accepted && damping < kMostDamping) {
        Matrix damped = H;
        damped.diagonal() += damping * floor;
        const Vector step = bounded_step(damped, gradient, best.theta, box);
        double cost = 0;
        const Vector trial = clamped(best.theta + step, box);
        Vector gradient_there;
        Matrix H_there;
        const double predicted = -step.dot(gradient) - 0.5 * step.dot(H.selfadjointView<Eigen::Lower>() * step);
        // A point without derivatives is no place to go on from.
        if (step.allFinite() && problem.cost(trial, cost) && std::isfinite(cost) && cost < best.cost &&
            (best.iterations + 1 == iterations || problem.normal_equations(trial, cost, gradient_there, H_there))) {
          const double gain = (best.cost - cost) / std::max(predicted, 1e-300);
          const double decrease = (best.cost - cost) / best.cost;
          small_steps = decrease < options_.relative_decrease ? small_steps + 1 : 0;
          best.theta = trial;
          best.cost = cost;
          gradient = std::move(gradient_there);
          H = std::move(H_there);
          damping = std::max(damping * std::max(1.0 / 5, 1 - std::pow(2 * gain - 1, 3)), 1e-15);
          growth = 2;
          accepted = true;
        } else {
          damping *= growth;
          growth *= 2;
        }
      }
      if (!accepted) {
        best.status = Status::ok;
        best.message = "no step reduces the cost further (round-off level)";
        return best;
      }
      if (small_steps >= options_.patience) {
        best.status = Status::ok;
        best.message = "relative decrease below tolerance";
        ++best.iterations;
        return best;
      }
    }
    best.message = "iteration limit reached";
    return best;
  }

 private:
  static double scaled_gradient(const Vector& gradient, const Vector& diagonal, double cost) {
    double largest = 0;
    for (Index i = 0; i < gradient.size(); ++i)
      if (diagonal(i) > 0) largest = std::max(largest, std::abs(gradient(i)) / std::sqrt(2 * diagonal(i) * cost));
    return largest;
  }

  LevenbergMarquardtOptions options_;
};

}  // namespace

std::unique_ptr<Solver> make_levenberg_marquardt(const LevenbergMarquardtOptions& options) {
  return std::make_unique<LevenbergMarquardt>(options);
}

}  // namespace wheelhop
