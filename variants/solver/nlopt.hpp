/// \file
/// The local algorithms of NLopt (Johnson, "The NLopt nonlinear-optimization package") on the scalar cost 1/2 ||r||^2.
/// They know neither residuals nor the Gauss-Newton matrix; parameters are scaled by its diagonal at the start where
/// the algorithm takes derivatives. Points outside the domain answer ten times the largest cost seen, with gradient
/// zero.
#pragma once

#include <memory>
#include <string>

#include "core/base/options.hpp"
#include "core/optimise/solver.hpp"

namespace wheelhop {

struct NloptOptions {
  std::string algorithm = "SLSQP";
  double relative_decrease = 1e-9;
  template <class V>
  void fields(V&& visit) {
    visit("algorithm", algorithm,
          Choices{{"SLSQP", "LBFGS", "VAR1", "VAR2", "TNEWTON", "TNEWTON_RESTART", "TNEWTON_PRECOND",
                   "TNEWTON_PRECOND_RESTART", "MMA", "CCSAQ", "BOBYQA", "COBYLA", "NELDERMEAD", "SBPLX", "NEWUOA",
                   "PRAXIS"}},
          "with gradient (to CCSAQ) and without; NEWUOA and PRAXIS keep no bounds");
    visit("relative_decrease", relative_decrease, Range{0, 1}, "-",
          "stop after a step that reduces the cost by less than this fraction");
  }
};

/// Why NLopt cannot be used in this build; empty where it can.
std::string nlopt_unavailable();
std::unique_ptr<Solver> make_nlopt(const NloptOptions& options);

}  // namespace wheelhop
