/// \file
/// Records in which samples are missing: filled in, or cut to a stretch that is whole.
#pragma once

#include <utility>
#include <vector>

#include "core/base/linalg.hpp"
#include "core/data/time_axis.hpp"

namespace wheelhop {

/// Most samples in a row that are filled in. A judgement: over more than that, what a polynomial makes of a record is
/// an invention.
inline constexpr Index longest_bridge = 10;

/// Fills in lost samples: the cubic polynomial through the two samples before and behind each gap (fewer at the ends of
/// the record). c x N -> c x (N + lost). A cubic is kept; a sine errs by less than (omega T (m + 1))^4 / 24 of its
/// amplitude over m samples.
Matrix bridge(ConstMatrixRef samples, const std::vector<LostSamples>& lost);

/// First sample and number of samples of the longest stretch of `samples` between the gaps; the first one of equals.
std::pair<Index, Index> longest_whole(Index samples, const std::vector<LostSamples>& lost);

}  // namespace wheelhop
