/// \file
/// Single bad samples of a logger: found by themselves, bridged, and listed.
#pragma once

#include <vector>

#include "core/data/records.hpp"

namespace wheelhop {

/// A sample of a channel that lies apart from its neighbours.
struct SpikeAt {
  Index channel = 0, sample = 0;
  double instead = 0;  ///< value of the cubic through two neighbours on either side
};

/// Spikes of signals that were measured together, ascending by channel and sample.
///
/// The error of the cubic through the four neighbours, e_k = y_k - (-y_{k-2} + 4 y_{k-1} + 4 y_{k+1} - y_{k+2}) / 6, is
/// A at a single bad sample of height A and -2/3 A on either side of it, which neither a step nor a sine does. One
/// counts if it has this shape, stands out from the median of |e| of the record and of its neighbourhood by more than
/// twenty standard deviations (fifty in a signal alone), and no other channel moves unusually at that time: an impact
/// shows in all that hangs together. The outermost two samples are not looked at.
/// @param y p x N   Cost: O(p N).
std::vector<SpikeAt> find_spikes(ConstMatrixRef y);

/// Bridges the spikes in the outputs of all records of a set, and lists them in `set.spikes`. Inputs stay as they are:
/// a drive may be a single pulse.
void bridge_spikes(RecordSet& set);

}  // namespace wheelhop
