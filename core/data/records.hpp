/// \file
/// A set of measured or simulated records: `records.json` and the files it names.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "core/data/signal.hpp"

namespace wheelhop {

/// What is known of the state in which a record begins. What is not told is free: a fit finds it.
struct KnownStart {
  bool rest = false;  ///< everything is at rest, in equilibrium under the first sample of the drives
  std::map<std::string, double> displacement_m = {}, velocity_m_per_s = {};       ///< by mass that slides
  std::map<std::string, double> angle_rad = {}, angular_velocity_rad_per_s = {};  ///< by mass that turns

  enum class Kind { sliding, turning };
  enum class Order { position, rate };
  /// Calls visit(key of the file, Kind, Order, values by mass) for each. @param start a KnownStart, const or not
  template <class Start, class V>
  static void fields(Start& start, V&& visit) {
    visit("displacement_m", Kind::sliding, Order::position, start.displacement_m);
    visit("velocity_m_per_s", Kind::sliding, Order::rate, start.velocity_m_per_s);
    visit("angle_rad", Kind::turning, Order::position, start.angle_rad);
    visit("angular_velocity_rad_per_s", Kind::turning, Order::rate, start.angular_velocity_rad_per_s);
  }

  bool operator==(const KnownStart&) const = default;
};

struct Record {
  std::string file;       ///< as written in records.json, relative to its folder
  std::string role;       ///< "estimation" or "validation"
  std::string repeat_of;  ///< records with the same name repeat one drive; empty if none does
  Index first = 0;        ///< sample of the file at which the signal begins
  Signal signal;
  Index rows = 0;                         ///< samples of the file that the signal was made of; 0: as many as it has
  Index line = 0;                         ///< of the file in which its first sample stands, from 1; 0: none
  std::vector<std::string> reading = {};  ///< what was done to the file to read it, a sentence each
  KnownStart start = {};
  bool continues = false;  ///< begins where the record before it in the set ends, as a piece of the same file

  /// Samples [first, file_end()) of the file are in the signal.
  Index file_end() const { return first + (rows > 0 ? rows : signal.samples()); }
  /// "line 7" or "sample 5" of the file, or "0.35 s" where samples were added or moved.
  std::string place(Index sample) const;
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

/// An output that was read less often than its record has samples.
struct SlowOutput {
  std::string file, channel;
  double samples = 1;   ///< a reading, in the mean
  double rate_hz = 0;   ///< of the readings
  std::string between;  ///< "repeated" or "lines"
  template <class V>
  void fields(V&& visit) {
    visit("file", file);
    visit("channel", channel);
    visit("samples", samples);
    visit("rate_hz", rate_hz);
    visit("between", between);
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

/// Reads `records.json` and the files it names, as reading.hpp tells: `{"sampling_hz"?, "resample_hz"?, "records":
/// [{"file", "role", "repeat_of"?, "range"?, "skip_initial"?}], "noise_std"?, "set"?}`, and `columns`, `time`,
/// `format`, `lost_samples` and `start` in the set or in a record.
/// - `start`: "free" (if nothing is said), "rest", or {"displacement_m"?: {MASS: value}, "velocity_m_per_s"?: ...}, of
/// masses that turn `angle_rad` and `angular_velocity_rad_per_s`. It is of the first sample that is read, and names
/// masses of the plant that the records are compared with.
/// - `sampling_hz` may be left out where the column of time tells it.
/// - `resample_hz`: every record is brought to this rate (resample.hpp), whatever its own is.
/// - `range` and `skip_initial` count samples of the file.
/// @param inputs, outputs the channels wanted; other columns, and what lies outside `range`, are not judged.
/// UserError with file and place for: every mistake in the JSON, no record, a file that does not read (reading.hpp), a
/// column of time that is no grid or at another rate than `sampling_hz` (time_axis.hpp), a range that is empty or
/// reaches beyond the file, fewer than two samples, a `skip_initial` that leaves nothing, a `noise_std` of an unknown
/// channel, a `set` that is not the one of the `provenance.json` beside it.
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
