/// \file
/// Channels that were read less often than their file has samples, as of a slow bus beside a fast logger: the logger
/// repeats a reading until the next one comes, or draws a straight line from one to the next.
#pragma once

#include <complex>
#include <vector>

#include "core/data/records.hpp"

namespace wheelhop {

/// Finds the channels of a signal that repeat their readings or draw lines between them, from the samples alone.
///
/// Repeated: samples that differ from the one before come at regular distances (nine in ten at the mean one, whole or
/// rounded either way, one more or less from three on), of more than one and a half samples in the mean, and their
/// steps are not of one size, as those of a coarse converter would be. Lines: the same of the samples at which the
/// second difference is not zero (a thousandth of the RMS step), of two and more.
/// @param y p x N   @return p entries, those of other channels empty; no entry at all if none is slow. Cost: O(p N).
std::vector<SlowChannel> slow_channels(ConstMatrixRef y);

/// Finds the slow channels of all records of a set.
void find_slow_channels(RecordSet& set);
/// Those that were found, record by record.
std::vector<SlowOutput> slow_outputs(const RecordSet& set);

/// Readings at every sample as a record of slow channels holds them, in place; behind the record they stay as they are.
/// @param y p x n, from the record's first sample on
void as_logged(const std::vector<SlowChannel>& slow, Matrix& y);

/// The same channels in samples [begin, begin + count) of a record. What was read outside of the part is not known
/// there: its first or last sample stands for it.
std::vector<SlowChannel> part_of(const std::vector<SlowChannel>& slow, Index begin, Index count);

/// Samples of a row (N) that were read, in their order: all of them if the channel is not slow.
Vector readings_of(const SlowChannel& slow, ConstVectorRef row);

/// Mean factor with which a slow channel shows a sine, besides its images at other frequencies: of one that repeats
/// every n-th sample sum_a exp(-2 pi i f a) / n, a = 0 ... n - 1. Over the first two hundred samples.
/// @param cycles f, a sample
std::complex<double> response_of(const SlowChannel& slow, double cycles);

}  // namespace wheelhop
