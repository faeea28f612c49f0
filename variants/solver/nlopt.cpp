#include "variants/solver/nlopt.hpp"

#ifdef WHEELHOP_HAS_NLOPT
#include <nlopt.h>

#include <algorithm>
#include <exception>
#include <utility>

#include "variants/solver/scaled.hpp"
#endif

namespace wheelhop {

#ifdef WHEELHOP_HAS_NLOPT
namespace {

/// NLopt's number of an algorithm, and whether it takes gradients.
std::pair<nlopt_algorithm, bool> algorithm_called(const std::string& name) {
  for (int i = 0; i < NLOPT_NUM_ALGORITHMS; ++i) {
    const auto algorithm = static_cast<nlopt_algorithm>(i);
    const std::string full = nlopt_algorithm_to_string(algorithm);  // "LD_SLSQP"
    if (full == "LD_" + name) return {algorithm, true};
    if (full == "LN_" + name) return {algorithm, false};
  }
  return {NLOPT_NUM_ALGORITHMS, false};
}

class Nlopt final : public Solver {
 public:
  explicit Nlopt(const NloptOptions& options) : options_(options) {}
  std::string name() const override { return "nlopt"; }
  bool takes_bounds() const override { return options_.algorithm != "NEWUOA" && options_.algorithm != "PRAXIS"; }

 protected:
  Solution search(const ResidualProblem& problem, ConstVectorRef theta0, const Budget& budget) const override {
    const auto [algorithm, gradients] = algorithm_called(options_.algorithm);
    if (algorithm == NLOPT_NUM_ALGORITHMS) {
      Solution none;
      none.status = Status::unavailable;
      none.message = "this NLopt has no algorithm " + options_.algorithm;
      none.theta = theta0;
      return none;
    }
    Asked asked{{problem, theta0, gradients}, gradients};
    if (!asked.problem.inside()) return asked.problem.solution(Status::outside_domain, "", 0);
    const Index n = theta0.size(), an_iteration = gradients ? 1 : n + 1;
    const Index most = budget.iterations < std::min<Index>(budget.evaluations, 1000000000) / an_iteration
                           ? budget.iterations * an_iteration
                           : std::min<Index>(budget.evaluations, 1000000000);
    const std::unique_ptr<nlopt_opt_s, void (*)(nlopt_opt)> optimiser(nlopt_create(algorithm, static_cast<unsigned>(n)),
                                                                      nlopt_destroy);
    if (!optimiser) throw std::bad_alloc();
    asked.optimiser = optimiser.get();
    const Box box = asked.problem.box();
    nlopt_srand(1);
    nlopt_set_min_objective(optimiser.get(), answer, &asked);
    if (takes_bounds()) {
      nlopt_set_lower_bounds(optimiser.get(), box.lower.data());
      nlopt_set_upper_bounds(optimiser.get(), box.upper.data());
    }
    nlopt_set_ftol_rel(optimiser.get(), options_.relative_decrease);
    nlopt_set_maxeval(optimiser.get(), static_cast<int>(most));
    Vector z = Vector::Zero(n);
    double value = 0;
    const nlopt_result end = nlopt_optimize(optimiser.get(), z.data(), &value);
    if (asked.thrown) std::rethrow_exception(asked.thrown);
    const Index iterations = (asked.answers + an_iteration - 1) / an_iteration;
    if (end == NLOPT_MAXEVAL_REACHED)
      return asked.problem.solution(Status::iteration_limit, "iteration limit reached", iterations);
    // Its general failure is what line searches end with where no step gains.
    const bool no_step = end == NLOPT_ROUNDOFF_LIMITED || (end == NLOPT_FAILURE && asked.answers > 1);
    if (end > 0) return asked.problem.solution(Status::ok, "relative decrease below tolerance", iterations);
    if (no_step) return asked.problem.solution(Status::ok, "no step reduces the cost further", iterations);
    return asked.problem.solution(Status::failed, nlopt_result_to_string(end), iterations);
  }

 private:
  struct Asked {
    ScaledProblem problem;
    bool gradients;
    nlopt_opt optimiser = nullptr;
    std::exception_ptr thrown = nullptr;
    Index answers = 0;
    double largest = 1;
    Vector gradient = {};
    Matrix H = {};
  };

  static double answer(unsigned n, const double* at, double* slopes, void* data) {
    Asked& asked = *static_cast<Asked*>(data);
    try {
      return answer(Eigen::Map<const Vector>(at, n), slopes, asked);
    } catch (...) {  // not through the frames of a C library
      asked.thrown = std::current_exception();
      nlopt_force_stop(asked.optimiser);
      return asked.largest;
    }
  }

  static double answer(const Vector& z, double* slopes, Asked& asked) {
    double value = 0;
    const bool inside = z.allFinite() && (asked.gradients ? asked.problem.derivatives(z, value, asked.gradient, asked.H)
                                                          : asked.problem.value(z, value));
    ++asked.answers;
    if (!inside) {
      if (slopes != nullptr) std::fill(slopes, slopes + z.size(), 0.0);
      return 10 * asked.largest;
    }
    asked.largest = std::max(asked.largest, value);
    if (slopes != nullptr) std::copy(asked.gradient.begin(), asked.gradient.end(), slopes);
    return value;
  }

  NloptOptions options_;
};

}  // namespace

std::string nlopt_unavailable() { return ""; }
std::unique_ptr<Solver> make_nlopt(const NloptOptions& options) { return std::make_unique<Nlopt>(options); }

#else

std::string nlopt_unavailable() { return "this build was made without NLopt (Debian: libnlopt-dev)"; }
std::unique_ptr<Solver> make_nlopt(const NloptOptions&) { throw UserError("nlopt: " + nlopt_unavailable()); }

#endif

}  // namespace wheelhop
