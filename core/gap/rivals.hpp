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

/// Parameters of the plant that may be out of tolerance: those whose surprise is above 1, fitted again without their
/// prior, side by side. `hypothesis` is the number of the parameter.
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
