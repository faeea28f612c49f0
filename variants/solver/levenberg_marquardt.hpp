/// \file
/// Levenberg-Marquardt on the normal equations (Levenberg 1944; Marquardt 1963) with a damping rule after Nielsen 1999,
/// "Damping parameter in Marquardt's method", IMM-REP-1999-05, and Marquardt's scaling by diag(J'J).
#pragma once

#include <memory>

#include "core/base/options.hpp"
#include "core/optimise/solver.hpp"

namespace wheelhop {

struct LevenbergMarquardtOptions {
  double initial_damping = 1e-4;
  double relative_decrease = 1e-7;
  Index patience = 3;
  template <class V>
  void fields(V&& visit) {
    visit("initial_damping", initial_damping, Range{1e-15, 1e6}, "-", "first damping relative to diag(J'J)");
    visit("relative_decrease", relative_decrease, Range{0, 1}, "-",
          "stop after `patience` accepted steps in a row that each reduce the cost by less than this fraction");
    visit("patience", patience, Range{1, 100}, "-", "see relative_decrease");
  }
};

std::unique_ptr<Solver> make_levenberg_marquardt(const LevenbergMarquardtOptions& options);

}  // namespace wheelhop
