/// \file
/// Inside of `diagnose`: from fitted hypotheses to an answer.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "core/gap/diagnose.hpp"
#include "core/gap/rivals.hpp"
#include "core/gap/scale.hpp"

namespace wheelhop {

/// Fall of chi2, over the noise's colour, from which an effect is more than chance.
inline constexpr double kNotice = 40;
/// Misfit - 1 below which an unexplained gap is no ground for any statement.
inline constexpr double kTooSmall = 0.1;
/// Surprise of a parameter from which it is out of tolerance; chi2, held-out records included and residuals over the
/// noise's colour, has to fall by its square once the parameter is free.
inline constexpr double kOutOfTolerance = 3;

/// Leftover of a place over that of the best place, from which the gap enters elsewhere.
inline constexpr double kElsewhere = 1.5;
/// Probability that the catalogue holds what explains a gap whole.
inline constexpr double kHeld = 0.97;

/// What has been computed and is being judged.
struct GapCase {
  const Study& study;
  const DiagnoseOptions& options;
  const Hypothesis& delivered;
  const Hypothesis& retuned;
  const std::vector<WrongScale>& wrong_scales;  ///< of the plant as delivered
  Random& random;
  const std::function<void(const std::string&)>& step;
  double floor_error;  ///< NoiseFloor::power_error
  double floor_chi2() const { return study.data.samples; }
  Closure closure_between(const GapStage& before, const GapStage& after) const {
    return closure(before.blocks, after.blocks, {options.draws, floor_error}, random);
  }
};

/// Effects alone and wrong parameters, which speak for or against each other.
struct Contest {
  std::vector<Hypothesis> singles;
  Changes changes;  ///< of the screen, for a second effect
  std::vector<Rival> rivals;
  bool effect_seen = false;  ///< one of them gains more than chance does
  bool parameter_seen = false;
  double left = 0;  ///< of the re-tuned plant's misfit, above the floor
};

/// Values and standard deviations of a fit's parameters from number `first` on; 0 where it is not linearised.
std::vector<FittedParameter> fitted_parameters(const PlantFit& fit, const std::vector<FitParameter>& list,
                                               std::size_t first);
/// @param rival the last effect of the hypothesis
Suspect suspect_of(const GapCase& c, const Rival& rival, const Hypothesis& hypothesis);

/// The re-tuned plant stands as the corrected one: nothing was added that could close a gap.
void correct_nothing(const GapCase& c, Diagnosis& diagnosis);

/// Adds the rivals that are probable enough to be told beside those named.
void add_ambiguous(const std::vector<Rival>& rivals, Diagnosis& diagnosis);

/// The verdict: nothing, a parameter, one effect or two, rounding, or a place outside the catalogue.
void judge(const GapCase& c, Diagnosis& diagnosis);

/// Nothing of the catalogue explains the gap: the answer is a place, and whether the plant's states make the signal.
void name_unknown(const GapCase& c, Diagnosis& diagnosis);
/// A converter whose steps make most of the noise: no model removes them, but they are the reason for the floor. False
/// if there is none.
bool name_rounding(const GapCase& c, Diagnosis& diagnosis);

/// Locations by the sum of the probabilities that speak for each, at most kLimit, in descending order.
std::vector<LocationProbability> ranked(const std::map<std::string, double>& sums);
/// Locations by the rivals that stand there.
void add_locations(const std::vector<Rival>& rivals, Diagnosis& diagnosis);
/// What an unknown signal at a location leaves, over what it leaves at the best place; 1 where it is not known.
double leftover_ratio(const std::vector<Place>& places, const std::string& location);
/// What that takes from the log probability of a rival at the location, >= 0.
double place_penalty(const std::vector<Place>& places, const std::string& location);

/// The answer is one parameter of the plant, free of its tolerance. False if that leaves a gap or drives other
/// parameters out of theirs; the message then says so.
bool name_parameter(const GapCase& c, const Rival& rival, Diagnosis& diagnosis);
/// One parameter inside its tolerance, where all others are nearer still: it makes the gap of the plant as delivered.
/// False if there is none.
bool name_standing_out(const GapCase& c, Diagnosis& diagnosis);

/// Names the most probable rival, an effect, alone. @return its hypothesis
Hypothesis name_first(const GapCase& c, const std::vector<Hypothesis>& singles, const std::vector<Rival>& rivals,
                      Diagnosis& diagnosis);
/// Looks for a second effect beside the best first ones. @param answer replaced if there is one, or if the search has
/// found a better fit of an effect alone, which is then weighed again among its rivals
/// @return true in the latter case: beside that fit there may be another second effect
bool add_second(const GapCase& c, Contest& contest, const Weighing& weighing, Hypothesis& answer, Diagnosis& diagnosis);

/// Takes from the probabilities what the answer leaves unexplained. One that explains too little, from the wrong place
/// or by absurd sizes is withdrawn: rounding or an unknown signal is named instead.
/// @param answer what the diagnosis names   @param rivals the most probable first
void doubt_answer(const GapCase& c, const Hypothesis& answer, const std::vector<Rival>& rivals, Diagnosis& diagnosis);

/// Checks by other means than those that found the answer. @param answer linearised
void check_answer(const GapCase& c, const Hypothesis& answer, Diagnosis& diagnosis);
/// What would tell the answer and its nearest rival apart.
void find_separating_test(const GapCase& c, Diagnosis& diagnosis);

}  // namespace wheelhop
