/// \file
/// The joint refinement: every matrix, weight, initial state and offset of a NonlinearModel by simulation error.
#pragma once

#include <memory>
#include <vector>

#include "core/model/sensitivities.hpp"
#include "core/optimise/solver.hpp"

namespace wheelhop {

/// r = (yhat_k - y_k) ./ weight_std after `skip` samples, theta as packed by core/model/sensitivities.hpp. Of a model
/// with limits yhat is what it would show without them, and r is 0 where y stands at a limit and yhat lies beyond it.
/// Outside the domain: a free run beyond the state guard.
/// Neither the cost nor the normal equations need memory that grows with the record.
/// @param u m x N   @param y p x N, both borrowed: they must outlive the problem   @param weight_std p, > 0
std::unique_ptr<ResidualProblem> free_run_problem(const NonlinearModel& model, ConstMatrixRef u, ConstMatrixRef y,
                                                  ConstVectorRef weight_std, Index skip);

struct Refinement {
  Solution solution;
  NonlinearModel model;
  Vector x0;
};

/// Minimises the free-run error from `model`, x0, under the prior of the map (StaticMap::precision), in stages of one
/// solver call each that share the budget.
Refinement refine(const NonlinearModel& model, ConstVectorRef x0, ConstMatrixRef u, ConstMatrixRef y,
                  ConstVectorRef weight_std, Index skip, const Solver& solver, const Budget& budget);

/// Inputs, outputs and initial state of one of several records; the first `skip` samples do not count.
struct FittedRecord {
  ConstMatrixRef u, y;  ///< m x N, p x N, borrowed
  Index skip = 0;
  Vector x0;  ///< n
};

/// The same over several records at once, each with an initial state of its own: that of record i becomes
/// records[i].x0 where the refinement ends inside the domain. Refinement::x0 is the first one.
Refinement refine(const NonlinearModel& model, std::vector<FittedRecord>& records, ConstVectorRef weight_std,
                  const Solver& solver, const Budget& budget);

}  // namespace wheelhop
