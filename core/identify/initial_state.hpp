/// \file
/// The initial state of a record that a model was not fitted to.
#pragma once

#include <vector>

#include "core/model/nonlinear.hpp"

namespace wheelhop {

/// A record as the model sees it, and its initial state.
struct StartedRecord {
  ConstMatrixRef u, y;  ///< m x N, p x N, borrowed
  Index skip = 0;       ///< samples at the start that do not count
  Vector x0;            ///< n
};

/// Mean and covariance of the states along free runs, and the RMS of their errors, over all records together.
/// Unknown where a free run leaves the state guard.
StateStatistics state_statistics(const NonlinearModel& model, const std::vector<StartedRecord>& records);

/// Samples from which the initial state of a record is estimated: three periods, or time constants, of the slowest
/// mode, at least 100, at most a quarter of the record.
Index initial_state_span(const LinearModel& model, Index samples);

/// With statistics the most probable initial state,
///   min over x0 of  sum_k |(y_k - yhat_k(x0)) ./ residual_std|^2 + (x0 - mean)' covariance^-1 (x0 - mean),
/// over the `samples` samples after the first `skip`, by Gauss-Newton from the best three of the mean and the points
/// one standard deviation from it along the principal axes of the covariance: a nonlinear model may have several
/// minima. Few samples determine some states badly; those then stay near where they were during the fit. Without
/// statistics by least squares, from the state that suits the model's linear part.
/// @param u m x N   @param y p x N   @param known of `model`, or empty
/// Cost: up to 90 runs with sensitivities over skip + samples samples, typically 15.
Vector estimate_initial_state(const NonlinearModel& model, ConstMatrixRef u, ConstMatrixRef y, Index samples,
                              Index skip = 0, const StateStatistics& known = {});

}  // namespace wheelhop
