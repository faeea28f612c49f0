/// \file
/// The diagnosis: whether there is a gap between a plant and its records, where it lies, which effect causes it, and
/// how far it shrinks with that effect.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "core/gap/closure.hpp"
#include "core/gap/effect.hpp"
#include "core/gap/locate.hpp"
#include "core/gap/noise_floor.hpp"

namespace wheelhop {

struct DiagnoseOptions {
  Index shortlist = 5;    ///< candidates of the screen that are fitted in full
  Index iterations = 12;  ///< cap of each fit
  Index effects = 2;      ///< at most so many effects are named
  double block_s = 2;     ///< of the bootstrap
  Index draws = 400;
};

/// A stage of the plant: as delivered, re-tuned, with the effect.
struct GapStage {
  double misfit = 0;          ///< mean r^2 on the held-out records, 1 at the floor
  std::vector<double> nrmse;  ///< a channel, RMS of the error over RMS of the record
  Vector blocks;              ///< misfit a block of time, over all held-out records
};

struct FittedParameter {
  std::string name;
  double value = 0, std = 0;
};

/// An effect or a parameter that the tool considered in full.
struct Suspect {
  std::string effect, location, form;
  double probability = 0;
  double misfit = 0;  ///< held out
  Closure closure;    ///< of what re-tuning leaves; of a parameter: of the gap as delivered
  std::vector<FittedParameter> parameters;
};

struct LocationProbability {
  std::string location;
  double probability = 0;
  double misfit = 0;  ///< of the best candidate there
};

enum class GapOutcome { none, parameter, effect, several, located_not_in_catalogue, ambiguous, insufficient };
std::string to_string(GapOutcome outcome);

struct Diagnosis {
  Status status = Status::ok;
  std::string message;
  NoiseFloor floor;
  bool held_out = true;  ///< false: there is no validation record, and every figure is of the records fitted
  GapOutcome outcome = GapOutcome::none;
  GapStage delivered, retuned, corrected;
  std::vector<FittedParameter> tolerances;  ///< every parameter re-tuned, in tolerances off
  std::vector<Suspect> suspects;            ///< best first
  std::vector<LocationProbability> locations;
  /// Where an unknown signal would enter, without the catalogue; of the plant as delivered and the re-tuned one, for
  /// each place the better: re-tuning may have bent the plant around what is missing.
  std::vector<Place> places;
  std::vector<std::string> named;  ///< "effect@location"
  std::vector<std::string> ambiguous_with;
  Closure closure;  ///< of what the answer removes
  double closure_of_retuning = 0;
  Plant plant;  ///< with the answer
};

/// @param candidates every effect at every place of a plant
/// @param step called with what is being done, for a progress line; may be empty
/// Status: outside_domain if the plant as delivered cannot follow the records' drives, or a fit of it fails.
/// UserError as load_records' sets demand: noise_floor, fit_record; records shorter than four blocks.
Diagnosis diagnose(const Plant& plant, const RecordSet& set,
                   const std::function<std::vector<EffectCandidate>(const Plant&)>& candidates, const Solver& solver,
                   const DiagnoseOptions& options, Random& random, const std::function<void(const std::string&)>& step);

}  // namespace wheelhop
