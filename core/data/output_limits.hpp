/// \file
/// Limits of the outputs: the values at which sensors, converters or overflows cut a channel off.
#pragma once

#include <vector>

#include "core/base/linalg.hpp"

namespace wheelhop {

/// An output y that is cut off shows min(max(y, low), high). A sample at a limit says that y was there or beyond.
struct OutputLimits {
  Vector low, high;  ///< p, in the unit of the outputs, infinite where there is none; empty: no output has one
  bool any() const { return low.size() > 0; }
};

/// The limits of outputs that were cut off. The highest value of an output is one if
/// - it stands three samples or longer in at least two places with other samples before and after, and ten samples in
///   all, and
/// - the signal comes to it by more than three steps of the resolution, the median over these places of the smaller of
///   the changes to the samples before and after: a rounded peak comes by one step.
/// Likewise the lowest. These are judgements: a signal that rests at its extreme value, or a single pulse with a flat
/// top, is not cut off.
/// @param outputs p x N each, all of the same channels; finite   Cost O(p N log N).
OutputLimits find_output_limits(const std::vector<ConstMatrixRef>& outputs);

/// Limits in other units of the outputs. @param scale p, > 0
OutputLimits over(const OutputLimits& limits, const Vector& scale);

/// Cuts outputs off. @param y p x N
void cut_off(const OutputLimits& limits, MatrixRef y);

/// Whether output i was cut off in a sample y, and a run without limits, y + error, lies beyond.
inline bool lies_beyond(const OutputLimits& limits, Index i, double y, double error) {
  return (y >= limits.high(i) && error > 0) || (y <= limits.low(i) && error < 0);
}

/// Errors of a run without limits, 0 where the sample stands at a limit and the run lies beyond: of a Gaussian error
/// the Tobit likelihood for one far above the noise (Tobin 1958, Econometrica 26, 24).
/// @param y p x N, as measured   @param error p x N, run minus y
void excuse_beyond(const OutputLimits& limits, ConstMatrixRef y, MatrixRef error);

}  // namespace wheelhop
