/// \file
/// Levenberg-Marquardt that carries its Jacobian along by secant updates (Broyden 1965, "A class of methods for solving
/// nonlinear simultaneous equations", Math. Comp. 19) and asks the problem for a new one only where the old one no
/// longer predicts: for problems whose Jacobian costs many residuals, such as differences of long simulations.
#pragma once

#include <memory>

#include "core/base/options.hpp"
#include "core/optimise/solver.hpp"

namespace wheelhop {

struct SecantLevenbergMarquardtOptions {
  double initial_damping = 1e-4;
  double relative_decrease = 1e-7;
  double trusted_gain = 0.5;
  double ending_share = 0.3;
  template <class V>
  void fields(V&& visit) {
    visit("initial_damping", initial_damping, Range{1e-15, 1e6}, "-", "first damping relative to diag(J'J)");
    visit("relative_decrease", relative_decrease, Range{0, 1}, "-",
          "stop after a step that reduces the cost by less than this fraction");
    visit("trusted_gain", trusted_gain, Range{0, 1}, "-",
          "a new Jacobian once a step brings less than this share of what the carried one promised");
    visit(
        "ending_share", ending_share, Range{0, 1}, "-",
        "a carried Jacobian ends the search only if the cost fell by less than this share since it was new; 1: always");
  }
};

std::unique_ptr<Solver> make_secant_levenberg_marquardt(const SecantLevenbergMarquardtOptions& options);

}  // namespace wheelhop
