/// \file
/// Ipopt, the interior-point line-search filter method (Waechter & Biegler 2006, Math. Programming 106), with the
/// Gauss-Newton matrix J'J as Hessian, or limited-memory BFGS. Bounds are its own. Ipopt's linear solver MUMPS is not
/// safe for threads: searches wait for one another.
#pragma once

#include <memory>
#include <string>

#include "core/base/options.hpp"
#include "core/optimise/solver.hpp"

namespace wheelhop {

struct IpoptOptions {
  std::string hessian = "gauss_newton";
  double tolerance = 1e-10;
  double relative_decrease = 1e-9;
  Index patience = 3;
  template <class V>
  void fields(V&& visit) {
    visit("hessian", hessian, Choices{{"gauss_newton", "limited_memory"}}, "J'J, or BFGS from gradients alone");
    visit("tolerance", tolerance, Range{1e-14, 1}, "-",
          "on the optimality error, relative to the cost at the start, in parameters scaled by diag(J'J)");
    visit("relative_decrease", relative_decrease, Range{0, 1}, "-",
          "stop after `patience` iterations in a row that each reduce the cost by less than this fraction");
    visit("patience", patience, Range{1, 100}, "-", "see relative_decrease");
  }
};

/// Why Ipopt cannot be used in this build; empty where it can.
std::string ipopt_unavailable();
std::unique_ptr<Solver> make_ipopt(const IpoptOptions& options);

}  // namespace wheelhop
