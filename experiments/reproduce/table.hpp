/// \file
/// The parts of `wheelhop reproduce`: config, one realisation, figures, files, print.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "experiments/experiment/config.hpp"
#include "experiments/reproduce/reproduce.hpp"
#include "experiments/run/statistics.hpp"

namespace wheelhop {

/// The models that are compared; columns of the table.
enum class Column { linear, as_printed, nonlinear, refined };
inline constexpr std::array<const char*, 4> kColumnNames = {"linear", "as_printed", "nonlinear", "refined"};
inline constexpr std::size_t kColumns = kColumnNames.size();

struct ReproduceConfig : ExperimentConfig {
  bool preset = false;  ///< read from the preset, whose choices notes() can explain
  PieceSet printed_pieces;
  PipelineOptions printed_pipeline;
};

/// The config of an experiment with the member `as_printed`: pieces and pipeline of the column beside it, over the
/// experiment's own. UserError for every mistake.
ReproduceConfig parse_reproduce_config(const JsonCursor& cursor);
/// Reads the request's config file and puts the request's own values over it. UserError for every mistake.
ReproduceConfig read_reproduce_config(const ReproduceRequest& request);

/// One model on one realisation's validation record.
struct ColumnScore {
  Status status = Status::failed;
  std::string message;
  std::array<double, 3> vaf_percent;          ///< against the outputs without noise
  std::array<double, 3> residual_over_noise;  ///< RMS of the residual over that of the noise; NaN without noise
};

/// How far the validation record leaves the range of the training record.
struct Beyond {
  Index samples = 0;                          ///< with any output outside
  std::array<double, 3> share_of_range = {};  ///< largest distance outside, over the width of the training range
};

/// One second in which the linear model first fails and then does well.
struct Segment {
  double contrast = -1;  ///< least VAF of the three at the end minus the largest at the start; negative: none found
  Index first = 0;       ///< sample of the validation record
  std::array<Matrix, 3> lines;  ///< 4 x samples a signal: measured, linear, nonlinear, refined
};

struct RealisationRow {
  Index realisation = 0;
  Status status = Status::failed;  ///< of records and main pipeline
  std::string message;
  std::array<ColumnScore, kColumns> columns;
  Index order = 0;
  double gap = 0;
  double direction_residual = 0;
  Index agreeing_starts = 0;
  std::vector<Pass> passes;  ///< without their models
  Index best_pass = -1;
  Refinements refinement;
  Beyond beyond;
  double direct_ratio = 0;  ///< of the refined model's Dt, chassis over axle, in physical units
  double spring_r2 = 0;     ///< nonlinear part of f against that of the true suspension force
  Segment segment;
  // For timing.json alone:
  double seconds = 0;             ///< generate, identify, refine, score
  double as_printed_seconds = 0;  ///< the column beside them
};

RealisationRow compute_realisation(const ReproduceConfig& config, Index realisation);

/// @param lines as in Segment, over the whole record
Segment find_segment(const std::array<Matrix, 3>& lines, double sample_time_s);

Statistics column_statistics(const std::vector<RealisationRow>& rows, std::size_t column, std::size_t signal);
/// Median and largest residual over noise.
Statistics noise_statistics(const std::vector<RealisationRow>& rows, std::size_t column, std::size_t signal);

/// What the paper leaves open: `[{"what", "chosen", "why"}]`.
Json notes(const ReproduceConfig& config);
Json table1_json(const ReproduceConfig& config, const std::vector<RealisationRow>& rows);
/// Null if no realisation has a segment.
Json figures_json(const ReproduceConfig& config, const std::vector<RealisationRow>& rows);
/// @param table of table1_json
void print_reproduction(const ReproduceConfig& config, const std::vector<RealisationRow>& rows, const Json& table);

}  // namespace wheelhop
