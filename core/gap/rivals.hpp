/// \file
/// Rival explanations of one gap, and how probable each is.
#pragma once

#include <string>
#include <vector>

#include "core/gap/hypothesis.hpp"

namespace wheelhop {

/// No probability is ever 1.
inline constexpr double kLimit = 0.99;

/// Deviations of a fit's parameters from their tolerances: how surprising the prior of each is to everything else. With
/// the prior left out the posterior is N(z / (1 - s), s / (1 - s)), s its variance in tolerances, against a prior of
/// N(0, 1); t^2 is what chi2 falls by if that prior is dropped.
/// @param fit linearised   @param count leading parameters that carry tolerances
Vector surprises(const PlantFit& fit, Index count);

/// Whether one parameter stands out from the others, which may all lie well inside what their tolerances allow: the
/// probability of each to be the one that is wrong, theta_k ~ N(0, 3^2), while all others are as near as the tolerances
/// scaled by a common unknown s in [0.1, 1] say, theta_i ~ N(0, s^2); against none, which has 0.8 before the data are
/// seen. By the evidence of the linearised fit, averaged over s (MacKay 1992, Neural Computation 4, 415).
/// @param fit linearised   @param count leading parameters that carry tolerances   @param colour of the noise
/// @return count, sum < 1
Vector standing_out(const PlantFit& fit, Index count, double colour);

/// An effect or a parameter error that may explain a gap.
struct Rival {
  std::string effect, location;
  std::size_t hypothesis = 0;  ///< index into the list it stands for; of a parameter, into the tolerances
  bool is_parameter = false;
  double chi2 = 0;
  double prior_chi2 = 0;  ///< of that, the squared priors of the parameters
  double plausibility = 0;
  double probability = 0;
  std::string name() const { return effect + "@" + location; }
};

/// One rival a hypothesis: the last of its effects.
std::vector<Rival> rivals_of(const std::vector<Hypothesis>& hypotheses);

/// Parameter `i` of the study's tolerances as a rival, with the chi2 of the re-tuned plant. `hypothesis` is i.
Rival parameter_rival(const Study& study, const Hypothesis& retuned, std::size_t i);

/// Parameters of the plant that may be out of tolerance: those whose surprise is above 1, fitted again without their
/// prior, side by side.
/// @param moved tolerances by which re-tuning has moved it at least
std::vector<Rival> parameter_rivals(const Study& study, const Hypothesis& retuned, double moved = 0);

/// What the probabilities are weighed with.
struct Weighing {
  double colour = 1;      ///< of the noise
  double gap = 0;         ///< chi2 of the plant without these effects, above the floor
  double floor_chi2 = 0;  ///< number of values
};

/// Keeps of each effect and place the most probable form, sets the probabilities, and sorts by them: log p = -(r^2 -
/// best) / (2 T) - z^2 / (2 sqrt(T)) + plausibility, chi2 = r^2 + z^2 (residuals and priors), T = colour + a gap + b
/// (best - 1.05 floor). No form in a catalogue is that of the rig, so that every one leaves some share of the gap; T is
/// how much of such a difference means nothing (a, b: by judgement, looked at on generated cases, not fitted). The
/// parameters' tolerances are what their owner says, and count for more; but a wrong form bends the parameters too.
/// None is above 0.99.
void weigh(std::vector<Rival>& rivals, const Weighing& weighing);

}  // namespace wheelhop
