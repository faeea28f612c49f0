/// \file
/// How far a gap shrinks: squared residuals against the noise floor, by blocks of time.
#pragma once

#include <limits>
#include <vector>

#include "core/base/linalg.hpp"
#include "core/base/random.hpp"

namespace wheelhop {

/// Mean of r^2 over blocks of time, r in units of the noise floor (1 at the floor): as many blocks of one length as
/// come nearest to the length asked for.
/// @param residual p x N   @param block samples, >= 1
Vector block_misfits(ConstMatrixRef residual, Index block);

struct Closure {
  double value = 0;          ///< 1 - (J_after - 1) / (J_before - 1)
  double low = 0, high = 0;  ///< 90 % interval
};

/// Closure of an answer that changes nothing: 0, and no interval.
inline constexpr Closure kNothingAdded{0, std::numeric_limits<double>::quiet_NaN(),
                                       std::numeric_limits<double>::quiet_NaN()};

/// How the interval of a closure is drawn.
struct Bootstrap {
  Index draws = 2000;
  double floor_error = 0;  ///< NoiseFloor::power_error: each draw takes another power for the noise, before and after
};

/// Share of the gap J - 1 that goes, with a paired bootstrap over blocks: both models are scored on the same draws.
/// Residual within a block hangs together, that of different blocks hardly (blocks of 2 s or more).
/// Draws that leave less than their noise cannot be: they count as 1, and not for the lower end.
/// NaN where nothing is above the floor before. @param before, after one value a block
Closure closure(ConstVectorRef before, ConstVectorRef after, const Bootstrap& bootstrap, Random& random);

/// Probabilities of rival models by held-out misfit: p_i ~ (J_i / J_best)^(-blocks / 2), the likelihood of residuals
/// whose size each model estimates and of which every block is worth one independent sample; never above `limit`.
/// @param misfits J_i > 0
Vector rival_probabilities(ConstVectorRef misfits, Index blocks, double limit);

}  // namespace wheelhop
