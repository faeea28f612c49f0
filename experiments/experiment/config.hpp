/// \file
/// One experiment of identification on simulated records: the plant, how its records are made, and the pieces and
/// options of the pipeline. `reproduce` runs it over realisations, `sweep` over a grid of its options.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "core/plant/plant.hpp"
#include "core/plant/road.hpp"
#include "experiments/experiment/study.hpp"

namespace wheelhop {

/// One row of the paper's Table 1.
struct PaperSignal {
  const char* name;   ///< sensor of the plant
  const char* title;  ///< of its figure
  int figure;
  double linear_vaf, nonlinear_vaf;  ///< percent
};
inline constexpr std::array<PaperSignal, 3> kPaperSignals = {{
    {"suspension_displacement", "Suspension displacement", 4, 75.0, 95.4},
    {"chassis_acceleration", "Chassis acceleration", 5, 74.2, 97.6},
    {"axle_acceleration", "Axle acceleration", 6, 72.6, 98.8},
}};

/// Where the quarter car of the paper stands in the plant graph; found through the three sensors.
struct QuarterCar {
  std::array<Index, 3> sensors{};  ///< rows of the outputs, in the order of kPaperSignals
  Index body = 0, wheel = 0;       ///< masses
  Index suspension = 0;            ///< element between them
};

/// How the records of a realisation are made.
struct DataOptions {
  double sampling_hz = 200;
  double settle_s = 2;
  double estimation_s = 60, validation_s = 60;
  Index substeps = 1;
  Index realisations = 20;
  Index seed = 1;
  std::optional<double> snr_db;
  Index initial_state_samples = 100;
  template <class V>
  void fields(V&& visit) {
    visit("sampling_hz", sampling_hz, Range{1e-3, 1e7}, "Hz", "samples of a record a second");
    visit("settle_s", settle_s, Range{0, 1e5}, "s", "simulated before each record begins");
    visit("estimation_s", estimation_s, Range{0, 1e6}, "s", "length of the training record, whole samples");
    visit("validation_s", validation_s, Range{0, 1e6}, "s", "length of the validation record, whole samples");
    visit("substeps", substeps, Range{1, 1000}, "-", "steps of the integrator a hold interval");
    visit("realisations", realisations, Range{1, 1e6}, "-", "how many pairs of records");
    visit("seed", seed, Range{0}, "-", "master seed of drives, noise, drawn parameters and initial guesses");
    visit("snr_db", snr_db, Range{-100, 300}, "dB", "noise this far below every output, in both records; null: none");
    visit("initial_state_samples", initial_state_samples, Range{1}, "-",
          "of the validation record, from which the free run's initial state is estimated");
  }
};

/// Departures from the paper's experiment. They stand in the effective config only where they are used.
struct DepartureOptions {
  std::optional<double> noise_corner_hz;
  bool draw_parameters = false;
  template <class V>
  void fields(V&& visit) {
    visit("noise_corner_hz", noise_corner_hz, Range{1e-3, 1e6}, "Hz",
          "noise is white through a first-order low-pass with this corner; null: white");
    visit("draw_parameters", draw_parameters,
          "each realisation has its own plant, drawn normally within the tolerances of the plant file");
  }
};

struct ExperimentConfig {
  Plant plant;
  std::optional<QuarterCar> car;  ///< none where the plant is another one
  DriveOptions drive;
  DataOptions data;
  DepartureOptions departures;
  std::vector<Index> outputs;  ///< sensors that are measured, ascending; all of the plant's unless the config says less
  PieceSet pieces;
  PipelineOptions pipeline;
  Json effective;  ///< all of it, defaults filled in; read as a config it is the same experiment

  /// Row of a sensor among the outputs measured; -1 if it is not.
  Index row_of(Index sensor) const;
};

/// Reads the members of a config:
///   plant             plant file, or the plant itself
///   plant_parameters  object of values over those of the plant, by the names of plant_parameters()
///   drive             of every input
///   outputs           names of the sensors that are measured; absent: all
/// those of DataOptions and DepartureOptions, `subspace`, `inversion`, `nonlinearity`, `solver` and `pipeline`. Files
/// are relative to the cursor's directory. Members that are no part of an experiment are left for `cursor.done()`.
/// UserError for every mistake.
ExperimentConfig parse_experiment_config(const JsonCursor& cursor);

/// `config.effective` anew, after a change of the config's members.
Json effective_config(const ExperimentConfig& config);

/// The quarter car of the paper in a plant. UserError that begins with `where` and says what is missing.
QuarterCar find_quarter_car(const Plant& plant, const std::string& where);

}  // namespace wheelhop
