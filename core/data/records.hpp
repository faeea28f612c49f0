/// \file
/// A set of measured or simulated records: `records.json` and the files it names.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "core/data/signal.hpp"

namespace wheelhop {

struct Record {
  std::string file;       ///< as written in records.json, relative to its folder
  std::string role;       ///< "estimation" or "validation"
  std::string repeat_of;  ///< records with the same name repeat one drive; empty if none does
  Index first = 0;        ///< sample of the file at which the signal begins
  Signal signal;
};

/// A bad sample that was bridged.
struct Spike {
  std::string file, channel;
  double time_s = 0;   ///< from the first sample of the file on
  double value = 0;    ///< as measured
  double instead = 0;  ///< as it is used
  template <class V>
  void fields(V&& visit) {
    visit("file", file);
    visit("channel", channel);
    visit("time_s", time_s);
    visit("value", value);
    visit("instead", instead);
  }
};

struct RecordSet {
  double sampling_hz = 0;
  std::vector<Record> records;
  std::map<std::string, double> noise_std;  ///< by channel, in the unit of the channel; may be empty
  std::vector<Spike> spikes;                ///< that were bridged after reading (spikes.hpp)
  std::string identity;                     ///< of a generated set: `set` in its JSON files; empty: none

  /// The records of a role, in the order of the file.
  std::vector<const Record*> with_role(const std::string& role) const;
};

/// Reads `records.json` and, once each, the files it names.
/// @param inputs, outputs the channels wanted; columns are found by name, in any order, and others are ignored.
/// UserError with file and place for: every mistake in the JSON, no record, a file that does not read (csv.hpp,
/// mat.hpp), a missing column (lists those there), a column `t` that is missing, not increasing, not uniform, or at
/// another rate than `sampling_hz`, a range that is empty or reaches beyond the file, fewer than two samples, a
/// `skip_initial` that leaves nothing, a `noise_std` of an unknown channel, a `set` that is not the one of the
/// `provenance.json` beside it.
///
/// Time counts as uniform if its instants keep within 1e-4 of a period of an even grid, or within what rounding to as
/// many decimals or significant digits as the column shows can explain. The rate of that grid may differ from
/// `sampling_hz` by 1e-4 of it; the signal carries 1 / sampling_hz. Only the samples inside `range` are checked.
RecordSet load_records(const std::filesystem::path& file, const std::vector<Channel>& inputs,
                       const std::vector<Channel>& outputs);
/// The same where `noise_std` may name channels that the files do not hold: a test that is yet to be run.
RecordSet load_records(const std::filesystem::path& file, const std::vector<Channel>& inputs,
                       const std::vector<Channel>& outputs, const std::vector<Channel>& planned);

/// Writes one file a record (columns t, inputs, outputs; t begins at 0) and then `records.json`, so that a set that can
/// be found is complete. Formats follow the endings of the file names; an empty name becomes `record_<number>.csv`.
/// UserError if something cannot be written; std::invalid_argument if two records share a file name, a name leaves the
/// folder, a role is unknown, a signal has another rate than the set, or channel names and rows differ in number.
void write_records(const std::filesystem::path& folder, const RecordSet& set);

}  // namespace wheelhop
