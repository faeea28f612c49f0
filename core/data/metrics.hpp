/// \file
/// Scores of a simulated output against a measured one, per output, after the leading `skip` samples.
#pragma once

#include "core/base/linalg.hpp"

namespace wheelhop {

/// Percent variance accounted for, per row, exactly as in the paper (no mean removal):
/// VAF = 100 (1 - sum (y - yhat)^2 / sum y^2). Unclipped: negative for a model worse than zero, -infinity when y is
/// identically zero but yhat is not (100 where both are zero); NaN where y or yhat is not finite.
/// @param y p x N measured   @param yhat p x N simulated   @param skip samples left out at the start
/// Throws std::invalid_argument if shapes differ or skip >= N.
Vector vaf_percent(ConstMatrixRef y, ConstMatrixRef yhat, Index skip = 0);

/// Root of the mean squared error per row, in the unit of y.
Vector rmse(ConstMatrixRef y, ConstMatrixRef yhat, Index skip = 0);

/// RMSE over the RMS of y (no mean removal), per row: VAF = 100 (1 - NRMSE^2). 0 where y and yhat are equal.
Vector nrmse(ConstMatrixRef y, ConstMatrixRef yhat, Index skip = 0);

/// Root mean square of each row after `skip` samples.
Vector rms(ConstMatrixRef y, Index skip = 0);

}  // namespace wheelhop
