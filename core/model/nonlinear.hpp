/// \file
/// The model class of the paper with the direct term its eq. (5) lacks:
///   x_{k+1} = A x_k + B u_k + Bt f_k,   y_k = C x_k + D u_k + Dt f_k + y0,   f_k = f(x_k, u_k).
/// Accelerations respond to a force at once, hence Dt. Outputs with limits are cut off there.
#pragma once

#include <functional>
#include <memory>

#include "core/base/status.hpp"
#include "core/data/output_limits.hpp"
#include "core/model/linear.hpp"
#include "core/model/static_map.hpp"

namespace wheelhop {

struct NonlinearModel {
  LinearModel linear;
  Matrix Bt;                             ///< n x q
  Matrix Dt;                             ///< p x q
  std::shared_ptr<const StaticMap> map;  ///< R^(n+m) -> R^q; nullptr for a linear model
  OutputLimits limits = {};              ///< of the outputs

  Index order() const { return linear.order(); }
  Index auxiliary_count() const { return Bt.cols(); }
};

/// What is known of a state before a record is seen: where it was along the records of the fit, and how far the model's
/// outputs were from theirs.
struct StateStatistics {
  Vector mean;          ///< n
  Matrix covariance;    ///< n x n, about the mean
  Vector residual_std;  ///< p, RMS of the free run's error, in the units of the model's outputs

  bool known() const { return mean.size() > 0; }
};

/// A linear model as a nonlinear one without a map.
NonlinearModel without_map(const LinearModel& model, const OutputLimits& limits = {});

struct FreeRun {
  Status status = Status::ok;  ///< outside_domain: a state exceeded the guard at sample `stopped_at`
  Index stopped_at = -1;
  Matrix x;  ///< n x N
  Matrix y;  ///< p x N; zero from `stopped_at` on
  Matrix f;  ///< q x N
};

/// Largest admissible |x_i| of a free run, in units of the whitened state. A model that leaves it has diverged.
inline constexpr double kStateGuard = 1e3;

/// Free-run simulation: only u and x0 are given. @param u m x N   @param x0 n
FreeRun free_run(const NonlinearModel& model, ConstMatrixRef u, ConstVectorRef x0);

/// States, outputs and f of the samples [first, first + x.cols()).
struct FreeRunBlock {
  Index first;
  ConstMatrixRef x, y, f;
};

/// The same block by block, in memory that does not grow with the record. The block in which the run leaves the guard
/// ends at the sample before, and no other follows.
/// @return the sample at which a state exceeded the guard, or -1
Index free_run_in_blocks(const NonlinearModel& model, ConstMatrixRef u, ConstVectorRef x0,
                         const std::function<void(const FreeRunBlock&)>& receive);

/// Folds a linear part f <- f + L [x; u] into the linear system:
/// A + Bt L_x, B + Bt L_u, C + Dt L_x, D + Dt L_u. @param L q x (n + m)
void fold_linear_part(NonlinearModel& model, ConstMatrixRef L);

}  // namespace wheelhop
