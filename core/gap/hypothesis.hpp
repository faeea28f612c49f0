/// \file
/// Hypotheses of what a plant lacks: none, one or several effects, each fitted to the estimation records and scored on
/// the held-out ones.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "core/gap/effect.hpp"
#include "core/gap/noise_floor.hpp"
#include "core/gap/screen.hpp"

namespace wheelhop {

/// The records of a set, made ready.
struct GapData {
  std::vector<FitRecord> fitted, held_out;
  bool apart = true;   ///< false: there is no validation record, and the fitted ones stand for it
  Index block = 1;     ///< samples of the bootstrap
  double samples = 0;  ///< values of all records that are scored, held-out ones once
};

/// UserError if a record is shorter than four blocks, or none has the role "estimation".
GapData gap_data(const Plant& plant, const RecordSet& set, const NoiseFloor& floor, double block_s);

/// A stage of the plant on the held-out records: as delivered, re-tuned, with the effect.
struct GapStage {
  double misfit = 0;          ///< mean r^2, 1 at the floor; infinite where the plant does not follow the drive
  std::vector<double> nrmse;  ///< a channel, RMS of the error over RMS of the record
  Vector blocks;              ///< misfit a block of time, over all held-out records
};

struct Hypothesis {
  std::vector<EffectCandidate> effects;  ///< in the order in which they were added; their plants are those before
  std::vector<FitParameter> parameters;  ///< tolerances first, then those of the effects
  Plant start;                           ///< from which they count
  PlantFit fit;                          ///< of the fitted records
  PlantFit held_out;                     ///< initial states alone, of the held-out records
  GapStage stage;
  double chi2 = 0;          ///< sum of r^2 over all records and of the squared priors
  double prior_chi2 = 0;    ///< of that, the squared priors: how far the parameters left their tolerances
  double plausibility = 0;  ///< sum of log_plausibility
};

/// "effect@location" of the last effect.
std::string name_of(const EffectCandidate& effect);

using CandidateList = std::function<std::vector<EffectCandidate>(const Plant&, const Operation&)>;

struct GapSolvers {
  const Solver& quick;     ///< for many fits of which most are dropped
  const Solver& thorough;  ///< for those that stay
  const Solver& patient;   ///< for all parameters at once, far from where they count
};

/// Everything that fitting a hypothesis reads.
struct Study {
  const Plant& nominal;
  const GapData& data;
  const GapSolvers& solvers;
  const CandidateList& candidates;
  std::vector<FitParameter> tolerances;
  Index iterations = 12;
};

/// The plant itself with some parameters free. Linearised. `fit.error` is empty where a simulation failed.
Hypothesis fit_hypothesis(const Study& study, const Plant& plant, std::vector<FitParameter> parameters);

/// The plant of a hypothesis, from its solution on, with other priors. Not linearised.
Hypothesis fit_from(const Study& study, const Hypothesis& base, std::vector<FitParameter> parameters);

/// The same hypothesis fitted again, from the values that its parameters have in another plant.
/// @param base with one effect at most, linearised
Hypothesis fit_at(const Study& study, const Hypothesis& base, const Plant& values);

/// Adds one effect to a hypothesis in all ways that the fast screen finds worth a fit.
struct ExtendOptions {
  Index shortlist = 10;      ///< fits at most, the best of the screen first
  Index forms = 3;           ///< of one effect at one place
  double worth = 0.1;        ///< screened gain over the best one's, below which a candidate is not fitted
  double least = 0;          ///< fall of chi2 that the screen must expect of the best for any to be fitted
  Index polished = 4;        ///< of the quick fits, the best that are fitted on to the end
  std::string without = {};  ///< "effect@location" that is not tried
};
/// @param base linearised   @return by chi2, ascending. Not linearised. Fits run side by side; the result does not
/// depend on how many.
/// @param changes of earlier screens of these records; added to
std::vector<Hypothesis> extend(const Study& study, const Hypothesis& base, const ExtendOptions& options,
                               Changes& changes);

}  // namespace wheelhop
