#include "variants/solver/ceres.hpp"

#ifdef WHEELHOP_HAS_CERES
#include <ceres/cost_function.h>
#include <ceres/problem.h>
#include <ceres/solver.h>
#include <glog/logging.h>

#include <cmath>
#include <mutex>

#include "core/identify/bounded_step.hpp"
#endif

namespace wheelhop {

#ifdef WHEELHOP_HAS_CERES
namespace {

class Block final : public ceres::CostFunction {
 public:
  explicit Block(const ResidualProblem& problem) : problem_(problem), r_(problem.residuals()), J_(0, 0) {
    set_num_residuals(static_cast<int>(problem.residuals()));
    mutable_parameter_block_sizes()->push_back(static_cast<int>(problem.parameters()));
  }

  bool Evaluate(const double* const* parameters, double* residuals, double** jacobians) const override {
    const Eigen::Map<const Vector> theta(parameters[0], problem_.parameters());
    if (!theta.allFinite()) return false;
    const bool slopes = jacobians != nullptr && jacobians[0] != nullptr;
    if (slopes) {
      J_.resize(problem_.residuals(), problem_.parameters());
      if (!problem_.jacobian(theta, r_, J_) || !J_.allFinite()) return false;
      Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(jacobians[0], J_.rows(),
                                                                                         J_.cols()) = J_;
    } else if (!problem_.residual(theta, r_)) {
      return false;
    }
    if (!r_.allFinite()) return false;
    Eigen::Map<Vector>(residuals, r_.size()) = r_;
    return true;
  }

 private:
  const ResidualProblem& problem_;
  mutable Vector r_;
  mutable Matrix J_;
};

class TrustRegion final : public Solver {
 public:
  explicit TrustRegion(const CeresOptions& options) : options_(options) {}
  std::string name() const override { return "ceres"; }

 protected:
  Solution search(const ResidualProblem& problem, ConstVectorRef theta0, const Budget& budget) const override {
    static std::once_flag silenced;
    std::call_once(silenced, [] { FLAGS_minloglevel = google::GLOG_FATAL; });
    Solution found;
    const Box box = problem.box();
    found.theta = clamped(theta0, box);
    ceres::Problem ceres_problem;
    ceres_problem.AddResidualBlock(new Block(problem), nullptr, found.theta.data());
    for (Index i = 0; i < box.lower.size(); ++i) {
      if (std::isfinite(box.lower(i)))
        ceres_problem.SetParameterLowerBound(found.theta.data(), static_cast<int>(i), box.lower(i));
      if (std::isfinite(box.upper(i)))
        ceres_problem.SetParameterUpperBound(found.theta.data(), static_cast<int>(i), box.upper(i));
    }
    ceres::Solver::Options options;
    options.trust_region_strategy_type =
        options_.trust_region == "levenberg_marquardt" ? ceres::LEVENBERG_MARQUARDT : ceres::DOGLEG;
    options.dogleg_type =
        options_.trust_region == "subspace_dogleg" ? ceres::SUBSPACE_DOGLEG : ceres::TRADITIONAL_DOGLEG;
    options.linear_solver_type = options_.linear_solver == "dense_qr" ? ceres::DENSE_QR : ceres::DENSE_NORMAL_CHOLESKY;
    options.max_num_iterations = static_cast<int>(std::min<Index>(budget.iterations, 1000000000));
    options.function_tolerance = options_.relative_decrease;
    options.gradient_tolerance = options.parameter_tolerance = 1e-14;
    options.max_num_consecutive_invalid_steps = 50;  // a free run may diverge many times before the region is small
    options.num_threads = 1;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &ceres_problem, &summary);
    found.cost = summary.final_cost;
    found.iterations = std::max<Index>(static_cast<Index>(summary.iterations.size()) - 1, 0);
    found.message = summary.message;
    found.gradient_norm = std::numeric_limits<double>::quiet_NaN();
    if (!(summary.initial_cost >= 0)) {
      found.status = Status::outside_domain;
      found.message = "the starting point lies outside the domain of the problem";
      found.theta = theta0;
    } else if (summary.termination_type == ceres::CONVERGENCE) {
      found.status = Status::ok;
    } else {
      found.status = summary.termination_type == ceres::NO_CONVERGENCE ? Status::iteration_limit : Status::ok;
    }
    return found;
  }

 private:
  CeresOptions options_;
};

}  // namespace

std::string ceres_unavailable() { return ""; }
std::unique_ptr<Solver> make_ceres(const CeresOptions& options) { return std::make_unique<TrustRegion>(options); }

#else

std::string ceres_unavailable() { return "this build was made without Ceres (Debian: libceres-dev)"; }
std::unique_ptr<Solver> make_ceres(const CeresOptions&) { throw UserError("ceres: " + ceres_unavailable()); }

#endif

}  // namespace wheelhop
