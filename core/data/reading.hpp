/// \file
/// From the file that a logger wrote to the channels of a record: which column is which, in which unit, at which rate.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/base/json.hpp"
#include "core/data/signal.hpp"
#include "core/data/text_layout.hpp"
#include "core/data/text_table.hpp"

namespace wheelhop {

/// True of names of columns that hold the time: "t", "t_ms", "Time (s)", "timestamp", "Zeit", "date".
bool is_time_name(const std::string& name);

/// Is a file of a record a MATLAB file, and not a text? UserError for an ending that is neither's.
bool is_mat_name(const std::filesystem::path& file);

/// The unit that a file tells for a column: behind its name, else in the row of units, without brackets. Empty: none.
/// @param asked how the column was asked for: what stands in brackets in a name that was asked for whole is a unit only
/// if it is one that is known
std::string column_unit(const TextLayout& layout, std::size_t place, const std::string& asked);

/// Where a channel stands in the file, and what its numbers are: (scale number + offset) in `unit`, divided by
/// `sensitivity` where there is one. Or what the channel was throughout the record, where no column tells it.
struct ColumnMap {
  std::string channel;
  std::string column;  ///< its name, with or without the unit behind it; empty: that of the channel, or by number
  Index number = 0;    ///< from 1; 0: by name
  std::string unit;    ///< empty: as the file tells it
  double scale = 1, offset = 0;
  std::string sensitivity;      ///< "100 mV/g"; empty: none
  std::optional<double> value;  ///< constant, in the channel's unit; there is no column then
  std::string where;            ///< place in records.json
};

struct TimeMap {
  std::string column = "t";
  Index number = 0;               ///< from 1; 0: by name
  std::string unit;               ///< empty: as the file tells it
  std::optional<double> rate_hz;  ///< there is no column of time: samples at this rate
  std::optional<double> scatter;  ///< how far instants may lie from the grid, in periods
  bool said = false;              ///< false: a file without "t" may have one column whose name says time instead
};

enum class LostRule { refuse, bridge, cut };

/// What records.json says of how a file is to be read; the default reads the plain one.
struct ReadingRequest {
  LayoutHints layout;
  std::vector<ColumnMap> columns;
  TimeMap time;
  LostRule lost = LostRule::refuse;
};

/// Reads the members `format` (text_layout.hpp), `columns`, `time` and `lost_samples` of a record, or of the set where
/// the record says nothing; `columns` channel by channel.
/// - `columns`: `{"CHANNEL": "name", 3, {"column": "name" or 3, "unit", "scale", "offset", "sensitivity"} or
///   {"value": 0.88}}`
/// - `time`: `"name"`, a number, or `{"column", "unit", "scatter"}`, or `{"rate_hz"}` where no column tells the time
/// - `lost_samples`: `"refuse"`, `"bridge"` or `"cut"`
/// UserError with file and JSON path. Keys of channels that nobody asks for are let pass: other commands may.
ReadingRequest read_reading_request(const JsonCursor& set, const JsonCursor& record);

/// A file with the columns that are wanted, as numbers of the file. Cells that hold none do not matter until a stretch
/// with them is taken.
class FileTable {
 public:
  /// UserError with file and place, and what to put into records.json: a file that does not read, a column that is
  /// missing or stands there twice, a unit that is not known or of another dimension than the channel's.
  FileTable(const std::filesystem::path& file, const ReadingRequest& request, const std::vector<Channel>& channels);

  const std::vector<std::string>& names() const { return names_; }  ///< of all columns of a text, of those wanted else
  Index samples() const { return table_.columns.cols(); }
  /// "line 7" or "sample 5": where the file holds a sample (counted from 0).
  std::string place(Index sample) const;
  Index line(Index sample) const;  ///< 0 where the file has no lines

  /// A stretch of the file on a uniform grid.
  struct Stretch {
    double sampling_hz = 0;
    Index first = 0, rows = 0;      ///< samples of the file that it was made of
    Matrix values;                  ///< channels x N, in their units
    std::vector<std::string> told;  ///< what was done to the file, a sentence each; empty for a plain one
  };
  /// @param count >= 2   @param sampling_hz the rate it has to be at; none: as the column of time tells
  /// UserError with file and place for a cell that is no finite number, instants that are no grid (time_axis.hpp), or a
  /// rate that nothing tells.
  Stretch take(Index first, Index count, std::optional<double> sampling_hz) const;

 private:
  void read_text_file(const ReadingRequest& request, const std::vector<Channel>& channels);
  void read_mat_file(const ReadingRequest& request, const std::vector<Channel>& channels);
  void use_columns(const ReadingRequest& request, const std::vector<Channel>& channels, const TextLayout& layout,
                   const std::vector<std::size_t>& places);
  void require_finite(Index first, Index count) const;
  Stretch take_columns(Index first, Index count, std::optional<double> sampling_hz) const;

  std::filesystem::path file_;
  std::string source_;
  LostRule lost_ = LostRule::refuse;
  TimeMap time_;
  std::vector<std::string> names_;
  bool text_ = true;
  TextTable table_;                                     ///< row 0 the time if there is one, then the channels
  std::vector<std::string> wanted_;                     ///< names of its rows in the file
  std::optional<double> time_factor_;                   ///< s per unit of the time column; none where nothing tells it
  std::vector<std::optional<double>> constants_;        ///< one a channel: what it is throughout; none: a column tells
  std::vector<std::pair<double, double>> conversions_;  ///< of the columns: value = first number + second
  std::vector<std::string> told_;
};

}  // namespace wheelhop
