#include "variants/solver/ipopt.hpp"

#ifdef WHEELHOP_HAS_IPOPT
#include <fmt/format.h>

#include <coin/IpIpoptApplication.hpp>
#include <coin/IpTNLP.hpp>

#include <mutex>

#include "variants/solver/scaled.hpp"
#endif

namespace wheelhop {

#ifdef WHEELHOP_HAS_IPOPT
namespace {

constexpr double kUnbounded = 2e19;  // beyond Ipopt's own 1e19
// Damping of the Hessian, as a share of its diagonal: from rounding to a thousandth of the undamped step.
constexpr double kLeastHessianDamping = 1e-12, kFirstHessianDamping = 1e-4, kMostHessianDamping = 1000;
constexpr double kHalfStep = 0.5, kLongStep = 0.9;  // shares of a step below and above which damping grows and falls
constexpr double kWholeStep = 0.1;                  // share of a step that says it was not cut short
constexpr double kNearBound = 1e-6;  // in scaled parameters: an interior point ends this near where a bound holds it

/// The problem as Ipopt asks for it. One linearisation answers for value, gradient and Hessian at a point.
class Asked final : public Ipopt::TNLP {
 public:
  using Number = Ipopt::Number;
  using Int = Ipopt::Index;

  Asked(ScaledProblem& problem, const IpoptOptions& options) : problem_(problem), options_(options) {}

  bool get_nlp_info(Int& n, Int& m, Int& nnz_jacobian, Int& nnz_hessian, IndexStyleEnum& style) override {
    n = static_cast<Int>(problem_.parameters());
    m = nnz_jacobian = 0;
    nnz_hessian = n * (n + 1) / 2;
    style = C_STYLE;
    return true;
  }
  bool get_bounds_info(Int n, Number* lower, Number* upper, Int, Number*, Number*) override {
    const Box box = problem_.box();
    for (Int i = 0; i < n; ++i) {
      lower[i] = std::max(box.lower(i), -kUnbounded);
      upper[i] = std::min(box.upper(i), kUnbounded);
    }
    return true;
  }
  bool get_starting_point(Int, bool, Number* x, bool, Number*, Number*, Int, bool, Number*) override {
    const Vector z = problem_.best();
    std::copy(z.begin(), z.end(), x);
    return true;
  }
  /// With the derivatives: nearly every point that Ipopt tries it keeps, and one without them is no place to go on
  /// from.
  bool eval_f(Int n, const Number* x, bool, Number& value) override {
    if (!linearise(x, n)) return false;
    value = value_;
    return true;
  }
  bool eval_grad_f(Int n, const Number* x, bool, Number* slopes) override {
    if (!linearise(x, n)) return false;
    std::copy(gradient_.begin(), gradient_.end(), slopes);
    return true;
  }
  bool eval_g(Int, const Number*, bool, Int, Number*) override { return true; }
  bool eval_jac_g(Int, const Number*, bool, Int, Int, Int*, Int*, Number*) override { return true; }
  bool eval_h(Int n, const Number* x, bool, Number factor, Int, const Number*, bool, Int, Int* rows, Int* columns,
              Number* values) override {
    if (values != nullptr && !linearise(x, n)) return false;
    for (Int j = 0, k = 0; j < n; ++j)
      for (Int i = j; i < n; ++i, ++k) {
        if (values != nullptr) {
          values[k] = factor * ((i == j ? 1 + damping : 1) * H_(i, j));
        } else {
          rows[k] = i;
          columns[k] = j;
        }
      }
    return true;
  }
  bool intermediate_callback(Ipopt::AlgorithmMode, Int iteration, Number value, Number, Number, Number, Number, Number,
                             Number, Number step, Int, const Ipopt::IpoptData*,
                             Ipopt::IpoptCalculatedQuantities*) override {
    iterations = before_ + iteration;
    small_steps_ = previous_ - value < options_.relative_decrease * std::abs(previous_) ? small_steps_ + 1 : 0;
    previous_ = value;
    // J'J alone is nearly singular, and Ipopt adds to a Hessian only where its inertia is wrong.
    if (iteration > 0) damping = step < kHalfStep ? damping * 4 : step > kLongStep ? damping / 4 : damping;
    damping = std::max(damping, kLeastHessianDamping);
    // A step that had to be cut short gains little without being near a minimum.
    settled = small_steps_ >= options_.patience && step > kWholeStep;
    return small_steps_ < options_.patience;
  }
  void finalize_solution(Ipopt::SolverReturn, Int, const Number*, const Number*, const Number*, Int, const Number*,
                         const Number*, Number, const Ipopt::IpoptData*, Ipopt::IpoptCalculatedQuantities*) override {}

  void start_again() {
    before_ = iterations;
    previous_ = std::numeric_limits<double>::infinity();
    small_steps_ = 0;
  }

  Index iterations = 0;
  bool settled = false;
  double damping = kFirstHessianDamping;  ///< of the Hessian's diagonal, as in Levenberg-Marquardt's method

 private:
  static Vector point(const Number* x, Int n) { return Eigen::Map<const Vector>(x, n); }
  bool linearise(const Number* x, Int n) {
    const Vector at = point(x, n);
    if (at_.size() == at.size() && at_ == at) return true;
    at_.resize(0);
    if (!problem_.derivatives(at, value_, gradient_, H_)) return false;
    at_ = at;
    return true;
  }

  ScaledProblem& problem_;
  const IpoptOptions& options_;
  Vector at_, gradient_;  // the point, and what belongs to it
  Matrix H_;
  double value_ = 0;
  double previous_ = std::numeric_limits<double>::infinity();
  Index small_steps_ = 0, before_ = 0;
};

class InteriorPoint final : public Solver {
 public:
  explicit InteriorPoint(const IpoptOptions& options) : options_(options) {}
  std::string name() const override { return "ipopt"; }

 protected:
  Solution search(const ResidualProblem& problem, ConstVectorRef theta0, const Budget& budget) const override {
    ScaledProblem scaled(problem, theta0, true);
    if (!scaled.inside()) return scaled.solution(Status::outside_domain, "", 0);
    static std::mutex one_at_a_time;
    const std::lock_guard<std::mutex> guard(one_at_a_time);
    const Ipopt::SmartPtr<Asked> asked = new Asked(scaled, options_);
    Status status = Status::ok;
    std::string message = "no step reduces the cost further";
    // Where its line search ends at the edge of the domain, Ipopt gives up: on from the best point with a damped
    // Hessian.
    const double most = options_.hessian == "gauss_newton" ? kMostHessianDamping : kFirstHessianDamping;
    for (; asked->damping <= most && asked->iterations < budget.iterations;
         asked->damping = std::max(100 * asked->damping, kFirstHessianDamping)) {
      const Ipopt::ApplicationReturnStatus end = run(asked, budget.iterations - asked->iterations);
      if (end == Ipopt::Maximum_Iterations_Exceeded) {
        status = Status::iteration_limit;
        message = "iteration limit reached";
        break;
      }
      const bool stopped_short = end == Ipopt::User_Requested_Stop ||
                                 end == Ipopt::Search_Direction_Becomes_Too_Small || end == Ipopt::Restoration_Failed ||
                                 end == Ipopt::Error_In_Step_Computation;
      if (asked->settled || end == Ipopt::Solve_Succeeded || end == Ipopt::Solved_To_Acceptable_Level) {
        message = asked->settled ? "relative decrease below tolerance" : "optimality tolerance met";
        break;
      }
      if (!stopped_short) {
        status = Status::failed;
        message = fmt::format("Ipopt ended with its status {}", static_cast<int>(end));
        break;
      }
    }
    scaled.settle_on_bounds(kNearBound);
    return scaled.solution(status, message, asked->iterations);
  }

 private:
  Ipopt::ApplicationReturnStatus run(const Ipopt::SmartPtr<Asked>& asked, Index iterations) const {
    const Ipopt::SmartPtr<Ipopt::IpoptApplication> program = new Ipopt::IpoptApplication(false);
    const auto options = program->Options();
    options->SetIntegerValue("print_level", 0);
    options->SetStringValue("sb", "yes");
    options->SetIntegerValue("max_iter", static_cast<Ipopt::Index>(std::min<Index>(iterations, 1000000000)));
    options->SetNumericValue("tol", options_.tolerance);
    options->SetNumericValue("acceptable_tol", options_.tolerance);  // no second, looser rule
    options->SetStringValue("nlp_scaling_method", "none");           // the problem is scaled already
    options->SetNumericValue("bound_relax_factor", 0);
    options->SetStringValue("mu_strategy", "adaptive");
    options->SetStringValue("hessian_approximation", options_.hessian == "gauss_newton" ? "exact" : "limited-memory");
    const Ipopt::ApplicationReturnStatus ready = program->Initialize("");
    if (ready != Ipopt::Solve_Succeeded) return ready;
    asked->start_again();
    return program->OptimizeTNLP(asked);
  }

  IpoptOptions options_;
};

}  // namespace

std::string ipopt_unavailable() { return ""; }
std::unique_ptr<Solver> make_ipopt(const IpoptOptions& options) { return std::make_unique<InteriorPoint>(options); }

#else

std::string ipopt_unavailable() { return "this build was made without Ipopt (Debian: coinor-libipopt-dev)"; }
std::unique_ptr<Solver> make_ipopt(const IpoptOptions&) { throw UserError("ipopt: " + ipopt_unavailable()); }

#endif

}  // namespace wheelhop
