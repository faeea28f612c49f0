/// \file
/// Records of plants that never forget. Where nothing holds a mass, as on a servo axis, a force moves it for good: in a
/// free run over a whole record the smallest error of a force adds up, and hides what else is missing. Such records
/// are compared in pieces, each with an initial state of its own (multiple shooting: H. G. Bock 1983).
#pragma once

#include "core/data/records.hpp"
#include "core/plant/plant.hpp"

namespace wheelhop {

/// Samples of a piece: the time in which the rest of the plant settles (to 1 %), between a 32nd and a quarter of the
/// longest record; a 16th where nothing settles. 0 where records stay whole: the plant linearised at rest has no pole
/// so near to zero that it integrates over the longest record (|s| T < 1), or pieces would be too short to tell
/// anything.
Index piece_samples(const Plant& plant, const RecordSet& set);

/// Every record in pieces of about that many samples, in their order; "est.csv, 2 to 4 s" is one's file. Pieces of
/// records that repeat a drive repeat each other, and no others do.
/// @param samples 0: the set as it is
RecordSet in_pieces(RecordSet set, Index samples);

}  // namespace wheelhop
