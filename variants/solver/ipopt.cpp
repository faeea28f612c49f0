#include "variants/solver/ipopt.hpp"

#ifdef WHEELHOP_HAS_IPOPT
#include <coin/IpIpoptApplication.hpp>
#include <coin/IpTNLP.hpp>

#include <mutex>

#include "variants/solver/scaled.hpp"
#endif

namespace wheelhop {

#ifdef WHEELHOP_HAS_IPOPT
namespace {

constexpr double kUnbounded = 2e19;  // beyond Ipopt's own 1e19
constexpr double kNearBound = 1e-6;  // in scaled parameters: an interior point ends this near where a bound holds it

/// The problem as Ipopt asks for it. One linearisation answers for gradient and Hessian at a point.
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
  bool get_starting_point(Int n, bool, Number* x, bool, Number*, Number*, Int, bool, Number*) override {
    std::fill(x, x + n, 0.0);
    return true;
  }
  bool eval_f(Int n, const Number* x, bool, Number& value) override { return problem_.value(point(x, n), value); }
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
          values[k] = factor * H_(i, j);
        } else {
          rows[k] = i;
          columns[k] = j;
        }
      }
    return true;
  }
  bool intermediate_callback(Ipopt::AlgorithmMode, Int iteration, Number value, Number, Number, Number, Number, Number,
                             Number, Number, Int, const Ipopt::IpoptData*, Ipopt::IpoptCalculatedQuantities*) override {
    iterations = iteration;
    small_steps_ = previous_ - value < options_.relative_decrease * std::abs(previous_) ? small_steps_ + 1 : 0;
    previous_ = value;
    settled = small_steps_ >= options_.patience;
    return !settled;
  }
  void finalize_solution(Ipopt::SolverReturn, Int, const Number*, const Number*, const Number*, Int, const Number*,
                         const Number*, Number, const Ipopt::IpoptData*, Ipopt::IpoptCalculatedQuantities*) override {}

  Index iterations = 0;
  bool settled = false;

 private:
  static Vector point(const Number* x, Int n) { return Eigen::Map<const Vector>(x, n); }
  bool linearise(const Number* x, Int n) {
    const Vector at = point(x, n);
    if (at_.size() == at.size() && at_ == at) return true;
    double value = 0;
    at_.resize(0);
    if (!problem_.derivatives(at, value, gradient_, H_)) return false;
    at_ = at;
    return true;
  }

  ScaledProblem& problem_;
  const IpoptOptions& options_;
  Vector at_, gradient_;  // where H_ and gradient_ belong to
  Matrix H_;
  double previous_ = std::numeric_limits<double>::infinity();
  Index small_steps_ = 0;
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
    const Ipopt::SmartPtr<Ipopt::IpoptApplication> program = new Ipopt::IpoptApplication(false);
    const auto options = program->Options();
    options->SetIntegerValue("print_level", 0);
    options->SetStringValue("sb", "yes");
    options->SetIntegerValue("max_iter", static_cast<Ipopt::Index>(std::min<Index>(budget.iterations, 1000000000)));
    options->SetNumericValue("tol", options_.tolerance);
    options->SetNumericValue("acceptable_tol", options_.tolerance);  // no second, looser rule
    options->SetStringValue("nlp_scaling_method", "none");           // the problem is scaled already
    options->SetNumericValue("bound_relax_factor", 0);
    options->SetStringValue("mu_strategy", "adaptive");
    options->SetStringValue("hessian_approximation", options_.hessian == "gauss_newton" ? "exact" : "limited-memory");
    if (program->Initialize("") != Ipopt::Solve_Succeeded)
      return scaled.solution(Status::failed, "Ipopt could not be initialised", 0);
    const Ipopt::ApplicationReturnStatus end = program->OptimizeTNLP(asked);
    scaled.settle_on_bounds(kNearBound);
    if (asked->settled) return scaled.solution(Status::ok, "relative decrease below tolerance", asked->iterations);
    switch (end) {
      case Ipopt::Solve_Succeeded:
      case Ipopt::Solved_To_Acceptable_Level:
        return scaled.solution(Status::ok, "optimality tolerance met", asked->iterations);
      case Ipopt::Maximum_Iterations_Exceeded:
        return scaled.solution(Status::iteration_limit, "iteration limit reached", asked->iterations);
      case Ipopt::Search_Direction_Becomes_Too_Small:
      case Ipopt::Restoration_Failed:
      case Ipopt::Error_In_Step_Computation:
        return scaled.solution(Status::ok, "no step reduces the cost further", asked->iterations);
      default:
        return scaled.solution(asked->iterations > 0 ? Status::ok : Status::failed,
                               "Ipopt ended with its status " + std::to_string(static_cast<int>(end)),
                               asked->iterations);
    }
  }

 private:
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
