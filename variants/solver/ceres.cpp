#include "variants/solver/ceres.hpp"

#ifdef WHEELHOP_HAS_CERES
#include <ceres/cost_function.h>
#include <ceres/problem.h>
#include <ceres/solver.h>
#include <glog/logging.h>

#include <cmath>
#include <limits>
#include <mutex>
#include <numeric>
#include <vector>

#include "core/optimise/bounded_step.hpp"
#endif

namespace wheelhop {

#ifdef WHEELHOP_HAS_CERES
namespace {

constexpr int kRounds = 50;  // active sets of bounds; a handful settles them

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Some components of theta as Ceres' only parameter block, the others held. A point answers with its derivatives at
/// once: nearly every step is kept, and one without them is no place to go on from.
class Block final : public ceres::CostFunction {
 public:
  Block(const ResidualProblem& problem, const Vector& theta, const std::vector<Index>& moving)
      : problem_(problem), theta_(theta), moving_(moving), r_(problem.residuals()) {
    set_num_residuals(static_cast<int>(problem.residuals()));
    mutable_parameter_block_sizes()->push_back(static_cast<int>(moving.size()));
  }

  bool Evaluate(const double* const* parameters, double* residuals, double** jacobians) const override {
    const Vector at = Eigen::Map<const Vector>(parameters[0], static_cast<Index>(moving_.size()));
    if (!at.allFinite()) return false;
    if (at_.size() == 0 || at_ != at) {
      at_.resize(0);
      theta_(moving_) = at;
      J_.resize(problem_.residuals(), problem_.parameters());
      if (!problem_.jacobian(theta_, r_, J_) || !r_.allFinite() || !J_.allFinite()) return false;
      at_ = at;
    }
    Eigen::Map<Vector>(residuals, r_.size()) = r_;
    if (jacobians != nullptr && jacobians[0] != nullptr)
      Eigen::Map<RowMajor>(jacobians[0], J_.rows(), at.size()) = J_(Eigen::all, moving_);
    return true;
  }

 private:
  const ResidualProblem& problem_;
  mutable Vector theta_;
  const std::vector<Index> moving_;
  mutable Vector at_, r_;  // where r_ and J_ belong to
  mutable Matrix J_;
};

class TrustRegion final : public Solver {
 public:
  explicit TrustRegion(const CeresOptions& options) : options_(options) {}
  std::string name() const override { return "ceres"; }

 protected:
  /// Ceres' projected steps stall where several bounds hold: what presses on its bound is held, the rest minimised, and
  /// again until the set stays and nothing more is gained.
  Solution search(const ResidualProblem& problem, ConstVectorRef theta0, const Budget& budget) const override {
    static std::once_flag silenced;
    std::call_once(silenced, [] { FLAGS_minloglevel = google::GLOG_FATAL; });
    const Box box = problem.box();
    Solution found;
    found.theta = clamped(theta0, box);
    found.status = Status::iteration_limit;
    bool gained = true;
    std::vector<Index> moving(static_cast<std::size_t>(problem.parameters()));
    std::iota(moving.begin(), moving.end(), Index{0});
    for (int round = 0; round < kRounds && found.iterations < budget.iterations; ++round) {
      if (round > 0) {
        std::vector<Index> free = inside(problem, found, box);
        if (free.empty() || (free == moving && !gained)) break;
        moving = std::move(free);
      }
      if (!step(problem, box, moving, budget.iterations - found.iterations, found, gained) && round == 0) {
        found.status = Status::outside_domain;
        found.message = "the starting point lies outside the domain of the problem";
        found.theta = theta0;
        return found;
      }
      if (box.lower.size() == 0 || found.status == Status::iteration_limit) break;
    }
    found.gradient_norm = std::numeric_limits<double>::quiet_NaN();
    return found;
  }

 private:
  /// Components that do not press on a bound; none where there are no derivatives.
  static std::vector<Index> inside(const ResidualProblem& problem, const Solution& at, const Box& box) {
    double cost = 0;
    Vector gradient;
    Matrix H;
    if (!problem.normal_equations(at.theta, cost, gradient, H)) return {};
    std::vector<Index> free;
    const Vector along = projected_gradient(gradient, at.theta, box);
    for (Index i = 0; i < along.size(); ++i)
      if (along(i) != 0 || gradient(i) == 0) free.push_back(i);
    return free;
  }

  /// One run of Ceres from found.theta. False if its first point does not answer.
  bool step(const ResidualProblem& problem, const Box& box, const std::vector<Index>& moving, Index iterations,
            Solution& found, bool& gained) const {
    Vector at = found.theta(moving);
    ceres::Problem ceres_problem;
    ceres_problem.AddResidualBlock(new Block(problem, found.theta, moving), nullptr, at.data());
    for (std::size_t k = 0; k < moving.size() && box.lower.size() > 0; ++k) {
      const Index i = moving[k];
      if (std::isfinite(box.lower(i)))
        ceres_problem.SetParameterLowerBound(at.data(), static_cast<int>(k), box.lower(i));
      if (std::isfinite(box.upper(i)))
        ceres_problem.SetParameterUpperBound(at.data(), static_cast<int>(k), box.upper(i));
    }
    ceres::Solver::Options options;
    options.trust_region_strategy_type =
        options_.trust_region == "levenberg_marquardt" ? ceres::LEVENBERG_MARQUARDT : ceres::DOGLEG;
    options.dogleg_type =
        options_.trust_region == "subspace_dogleg" ? ceres::SUBSPACE_DOGLEG : ceres::TRADITIONAL_DOGLEG;
    options.linear_solver_type = options_.linear_solver == "dense_qr" ? ceres::DENSE_QR : ceres::DENSE_NORMAL_CHOLESKY;
    options.max_num_iterations = static_cast<int>(std::min<Index>(iterations, 1000000000));
    options.function_tolerance = options_.relative_decrease;
    options.gradient_tolerance = options.parameter_tolerance = 1e-14;
    options.max_num_consecutive_invalid_steps = 50;  // a free run may diverge many times before the region is small
    options.num_threads = 1;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &ceres_problem, &summary);
    if (!(summary.initial_cost >= 0)) return false;
    found.theta(moving) = at;
    found.cost = summary.final_cost;
    found.iterations += std::max<Index>(static_cast<Index>(summary.iterations.size()) - 1, 0);
    found.message = summary.message;
    gained = (summary.initial_cost - summary.final_cost) > options_.relative_decrease * summary.initial_cost;
    found.status = summary.termination_type == ceres::CONVERGENCE      ? Status::ok
                   : summary.termination_type == ceres::NO_CONVERGENCE ? Status::iteration_limit
                                                                       : Status::failed;
    return true;
  }

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
