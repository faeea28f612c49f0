/// \file
/// The noise floor of a set of records: the denominator of every statement about a gap.
#pragma once

#include <string>
#include <vector>

#include "core/data/records.hpp"
#include "core/plant/plant.hpp"

namespace wheelhop {

enum class FloorSource { repeats, noise_std, estimated };
/// "repeats of one drive", "noise_std of the record set" or "estimated from the quiet end of the spectrum".
std::string to_string(FloorSource source);

struct NoiseFloor {
  FloorSource source = FloorSource::estimated;
  Vector std;         ///< p, of one record, in the units of the outputs; > 0
  Index degrees = 0;  ///< samples behind each value of std
  /// Standard error of the noise power, in units of std^2 and averaged over the channels: from repeats by blocks of
  /// time, so that coloured noise counts for as little as it tells; 0 of a given `noise_std`; of an estimate a tenth
  /// and what its median scatters.
  double power_error = 0;
  /// Largest density of the noise over its mean density, over all channels: 1 for white noise. What a signal of one
  /// band seems to explain by chance grows by it. From repeats; 1 where there are none.
  double colour = 1;
  std::vector<std::vector<std::string>> repeats;  ///< files of one drive each, where the floor is from repeats
};

/// Records of one drive.
using Repeats = std::vector<const Record*>;

/// One drive as it was measured: the mean of its repeats, or a single record.
struct Measured {
  std::string name;   ///< `repeat_of`, or the file
  std::string role;   ///< "estimation" or "validation"
  Signal signal;      ///< inputs and outputs averaged over the repeats
  Index repeats = 1;  ///< the noise of the mean is floor / sqrt(repeats)
  Vector quantum;     ///< p, step of the lattice on which a single record's values lie; 0: none seen
  KnownStart start = {};
  bool continues = false;  ///< as of the first of them
};

/// The records of a set that have one drive, in whatever role: those of one `repeat_of`, and those of one length
/// without `repeat_of` whose inputs differ by at most 15 % of the largest drive of their unit (RMS over RMS), unless
/// one is a copy of the other. Groups of at least two. UserError if records of one `repeat_of` differ in length, or in
/// an input by more than 50 %.
std::vector<Repeats> repeats_of(const RecordSet& set);

/// What does not repeat, y - mean of the group, of each record, p x the samples that all of them score.
std::vector<Matrix> noise_of_repeats(const Repeats& group);

/// Averages the records of one role, `repeat_of` and start whose inputs differ by at most 5 % as above; the others
/// stand alone. UserError as `repeats_of`.
std::vector<Measured> merge_repeats(const RecordSet& set);

/// The set with its outputs replaced by what a plant leaves of them, y - yhat(u) from rest, where repeats of a drive
/// were measured with inputs that differ; otherwise the set as it is. The floor of a prediction from measured drives is
/// what of its error does not repeat. Noise of the drives is in it then, as the plant answers to it, and a drive that
/// truly differed from run to run is not, since the plant follows it.
/// Returns the set as it is where the plant does not follow a drive. Cost: a simulation of each record.
RecordSet prediction_errors(const Plant& plant, const RecordSet& set);

/// Standard deviation of each output's noise, in the samples that are scored.
///
/// From repeats, as `repeats_of` finds them: within-group variance sum_r sum_k (y_rk - mean_k)^2 / ((R - 1) K), pooled
/// over groups; it holds all that does not repeat, coloured or not: differences from run to run are in it, which no
/// sensor makes. Of records that only look like repeats it is `noise_std` where that is larger. Else `noise_std` of the
/// set, which must then name every output. Else an estimate: white noise of the level seen in the upper fifth of the
/// band, where a vehicle's response is gone; the median over lines, so that single tones do not count. Coloured noise
/// is stronger in the band than that says.
///
/// UserError as merge_repeats; if `noise_std` names some outputs only; if an output is constant or the same in every
/// repeat to the last digit, where no floor can be told.
NoiseFloor noise_floor(const RecordSet& set);

/// Largest mean density of a band over the mean density of all, over the channels: 1 for white noise, and of records
/// too short for bands. @param noise p x N, N > 1
double colour_of(ConstMatrixRef noise);

/// Step of the coarsest lattice offset + k step on which all values lie, if they are few enough for a converter to be
/// seen in them (each met four times on average); 0 otherwise.
double lattice_step(ConstVectorRef values);

}  // namespace wheelhop
