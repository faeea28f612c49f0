/// \file
/// What a logger's file holds, column by column, before anybody says what it is for.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/base/json.hpp"
#include "core/base/linalg.hpp"
#include "core/data/text_layout.hpp"
#include "core/data/time_axis.hpp"

namespace wheelhop {

/// A column of numbers. Cells that hold none are left out, except from `missing`.
struct ColumnFacts {
  std::string name, unit;  ///< unit as the file tells it; empty: it does not
  Index number = 0;        ///< of the column, from 1
  Index missing = 0;       ///< cells without a finite number; as many as there are samples in a column of text
  double low = 0, high = 0;
  double resolution = 0;       ///< smallest distance of two values, where at most half of the values differ; else 0
  Index clipped = 0;           ///< samples that stand at the lowest or highest value, three or more in a row
  std::vector<Index> spikes;   ///< single bad samples, as `find_spikes` of this column alone
  double spectrum_end_hz = 0;  ///< 99.9 % of the power without the mean lies below; 0 where cells are missing or
                               ///< nothing moves
  double slow_samples = 1;     ///< a reading, in the mean: more than 1 where it was read at a lower rate
  bool slow_lines = false;     ///< with straight lines between the readings; else these are repeated
};

/// The facts of one column. @param sample_time_s 0: the rate is not known, and neither is the end of the spectrum
/// Cost: N log N.
ColumnFacts column_facts(ConstVectorRef x, double sample_time_s);

struct FileFacts {
  bool text = true;
  TextLayout layout;  ///< of a text
  Index samples = 0;
  std::string time;         ///< column that tells the time; empty: none found
  std::string time_unit;    ///< as the file tells it, or guessed; empty for dates
  bool time_dates = false;  ///< the column holds dates and times
  bool unit_guessed = false;
  std::optional<TimeGrid> grid;      ///< none where the instants are no grid
  bool scatter_asked = false;        ///< there is one only because instants may lie far from it
  std::string problem;               ///< why there is none
  std::vector<ColumnFacts> columns;  ///< without the time
  std::vector<std::string> lost;     ///< places of lost samples: "3 before line 502"
};

/// Reads every column of a file of any kind that records may name. The time is the column called t, one whose name
/// begins with time, zeit or date, or one of dates. Its unit, where the file does not tell it, is the first of s, ms,
/// us that gives `sampling_hz`, or a rate from 10 Hz on.
/// @param sampling_hz what is known of the rate; none: to be found
/// UserError as find_layout and read_mat_vectors say.
FileFacts inspect_file(const std::filesystem::path& file, const LayoutHints& hints, std::optional<double> sampling_hz);

/// The `records.json` that reads the file: one record, with everything that has to be said. @param name of the file in
/// it
/// @param sampling_hz the rate of samples without a column of time. UserError where no rate is known.
Json records_that_read(const FileFacts& facts, const LayoutHints& hints, const std::string& name,
                       std::optional<double> sampling_hz);

}  // namespace wheelhop
