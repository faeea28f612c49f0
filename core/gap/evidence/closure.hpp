/// \file
/// How far a gap shrinks: squared residuals against the noise floor, by blocks of time.
#pragma once

#include "core/base/random.hpp"
#include "core/gap/verdict/evidence.hpp"

namespace wheelhop {

/// Mean of r^2 over blocks of time, r in units of the noise floor (1 at the floor): as many blocks of one length as
/// come nearest to the length asked for.
/// @param residual p x N   @param block samples, >= 1
Vector block_misfits(ConstMatrixRef residual, Index block);

/// How the interval of a closure is drawn.
struct Bootstrap {
  Index draws = 2000;
  double floor_error = 0;  ///< NoiseFloor::power_error: each draw takes another power for the noise, before and after
  std::uint64_t seed = 1;  ///< same seed, same draws: closures of one diagnosis are compared on the same blocks
};

/// Share of the gap J - 1 that goes, with a paired bootstrap over blocks: both models are scored on the same draws.
/// Residual within a block hangs together, that of different blocks hardly (blocks of 2 s or more).
/// Draws that leave less than their noise cannot be: they count as 1, and not for the lower end.
/// NaN where nothing is above the floor before. @param before, after one value a block
Closure closure(ConstVectorRef before, ConstVectorRef after, const Bootstrap& bootstrap);

}  // namespace wheelhop
