/// \file
/// Whether what a model leaves is noise.
#pragma once

#include "core/base/linalg.hpp"

namespace wheelhop {

/// Share, by output, of the square of a residual that follows from its own last ten samples and from the inputs of this
/// and the last ten samples: the adjusted R^2 of that regression, at least 0. White noise leaves 0. With white noise of
/// variance s^2 and a model error that moves slowly from sample to sample, of mean square e^2, it is about e^2 / (e^2 +
/// s^2); coloured noise of a sensor counts as model error. Cost O(N (11 p + 11 m)^2).
/// @param residual p x N   @param u m x N, N larger than twice the number of regressors: else 0 is returned
Vector residual_share(ConstMatrixRef residual, ConstMatrixRef u);

}  // namespace wheelhop
