/// \file
/// The diagnosis: whether there is a gap between a plant and its records, where it lies, which effect causes it, and
/// how far it shrinks with that effect.
#pragma once

#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "core/base/random.hpp"
#include "core/gap/closure.hpp"
#include "core/gap/hypothesis.hpp"
#include "core/gap/locate.hpp"
#include "core/gap/plan.hpp"

namespace wheelhop {

struct DiagnoseOptions {
  Index iterations = 12;  ///< cap of each fit
  Index effects = 2;      ///< at most so many effects are named
  double block_s = 2;     ///< of the bootstrap
  Index draws = 2000;
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
};

enum class GapOutcome {
  none,
  parameter,
  effect,
  several,
  located_not_in_catalogue,
  exogenous,  ///< located, but no function of the plant's states
  ambiguous,
  insufficient
};
std::string to_string(GapOutcome outcome);

/// A check of the answer by other means than those that found it.
struct Check {
  std::string name;
  bool passed = false;
  std::string detail;
};

struct Diagnosis {
  Status status = Status::ok;
  std::string message;
  NoiseFloor floor;
  bool held_out = true;      ///< false: there is no validation record, and every figure is of the records fitted
  double judged_from_s = 0;  ///< start of the records that no figure counts, as `judged_from`
  GapOutcome outcome = GapOutcome::none;
  GapStage delivered, retuned, corrected;
  std::vector<FittedParameter> tolerances;     ///< every parameter re-tuned, in tolerances off
  Index most_retuned = -1;                     ///< of these, the one that changes the outputs most
  std::vector<Suspect> suspects;               ///< the named ones first, then by probability
  std::vector<LocationProbability> locations;  ///< most probable first
  /// Where an unknown signal would enter the re-tuned plant, without the catalogue; where one factor is wrong
  /// (`one_scale`) the plant as delivered, since re-tuning bends itself around that.
  std::vector<Place> places;
  std::vector<PlacePair> place_pairs;  ///< the same for two places, where no single one explains all; else empty
  /// How many places it takes to explain what re-tuning leaves: 1, 2, or 0 where neither one unknown signal nor two do
  /// ("not locatable"), or too few channels tell. Of a pair that is the best place and an accelerometer upon it, or two
  /// of these, one place may be enough for a force that jumps: 1 as well.
  int places_needed = 0;
  std::vector<Place> places_left;  ///< as `places`, of the plant with the effects named; empty if none is added
  std::vector<std::string> named;  ///< "effect@location", most sure first
  Vector shares;                   ///< of the effects named in the closure, as effect_shares; empty unless several are
  std::vector<std::string> ambiguous_with;
  /// Of what re-tuning leaves, by the plant with the answer; of a parameter: of the gap as delivered. 0 and no interval
  /// of an answer that is no plant: nothing missing, rounding, a place outside the catalogue.
  Closure closure;
  double closure_of_retuning = std::numeric_limits<double>::quiet_NaN();  ///< NaN without a gap
  Plant plant;                                                            ///< with the answer
  Plant retuned_plant;  ///< re-tuned inside the tolerances, without any effect
  std::vector<Check> checks;
  SeparatingTest separating;  ///< of the answer and its nearest rival; `test` empty where there is none, or none helps
};

/// Whether the answer is a converter's rounding: quantisation that no model of the plant takes away.
bool is_rounding(const Diagnosis& diagnosis);

/// What a suspect (of this diagnosis) contributes to the closure of the answer; NaN if it is not one of several named.
double share_of(const Diagnosis& diagnosis, const Suspect& suspect);

/// @param candidates every effect at every place of a plant
/// @param step called with what is being done, for a progress line; may be empty
/// Status: outside_domain if the plant as delivered cannot follow the records' drives, or a fit of it fails.
/// UserError as load_records' sets demand: noise_floor, fit_record; records shorter than four blocks.
Diagnosis diagnose(const Plant& plant, const RecordSet& set, const CandidateList& candidates, const GapSolvers& solvers,
                   const DiagnoseOptions& options, Random& random, const std::function<void(const std::string&)>& step);

}  // namespace wheelhop
