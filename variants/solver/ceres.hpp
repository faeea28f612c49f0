/// \file
/// Ceres Solver (Agarwal, Mierle et al.): its trust-region methods on one residual block with the analytic Jacobian.
/// Memory holds that Jacobian whole, residuals times parameters. Its iterations count rejected steps as well. The
/// result has no gradient norm (NaN).
#pragma once

#include <memory>
#include <string>

#include "core/base/options.hpp"
#include "core/optimise/solver.hpp"

namespace wheelhop {

struct CeresOptions {
  std::string trust_region = "levenberg_marquardt";
  std::string linear_solver = "dense_qr";
  double relative_decrease = 1e-9;
  template <class V>
  void fields(V&& visit) {
    visit("trust_region", trust_region, Choices{{"levenberg_marquardt", "dogleg", "subspace_dogleg"}},
          "Levenberg-Marquardt, Powell's dogleg, or a plane in place of the dogleg");
    visit("linear_solver", linear_solver, Choices{{"dense_qr", "dense_normal_cholesky"}},
          "of each step: on the Jacobian, or on J'J");
    visit("relative_decrease", relative_decrease, Range{0, 1}, "-",
          "stop after a step that reduces the cost by less than this fraction");
  }
};

/// Why Ceres cannot be used in this build; empty where it can.
std::string ceres_unavailable();
std::unique_ptr<Solver> make_ceres(const CeresOptions& options);

}  // namespace wheelhop
