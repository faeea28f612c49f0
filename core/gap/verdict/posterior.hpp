/// \file
/// How probable each explanation of one gap is: posterior probabilities of candidates and of wrong parameters.
#pragma once

#include <string>
#include <vector>

#include "core/gap/verdict/evidence.hpp"
#include "core/gap/verdict/thresholds.hpp"

namespace wheelhop {

/// Deviations of parameters from their tolerances as the data alone see them: how surprising the prior of each is to
/// everything else. With the prior left out the posterior is N(theta / (1 - s), s / (1 - s)), s its variance in
/// tolerances, against a prior of N(0, 1); z^2 is what chi2 falls by if that prior is dropped.
/// @param theta n, posterior means in tolerances   @param covariance of these, n x n or larger
Vector leave_prior_out_z(ConstVectorRef theta, ConstMatrixRef covariance);

/// Whether one parameter stands out from the others, which may all lie well inside what their tolerances allow: the
/// probability of each to be the one that is wrong, theta_k ~ N(0, wrong_by^2), while all others are as near as the
/// tolerances scaled by a common unknown s in [0.1, 1] say, theta_i ~ N(0, s^2); against none, which has 1 - one_wrong
/// before the data are seen. By the evidence of the linearised fit, averaged over s (MacKay 1992, Neural Computation 4,
/// 415).
/// @param theta, covariance as above   @param colour of the noise   @return n, sum < 1
Vector standing_out(ConstVectorRef theta, ConstMatrixRef covariance, double colour, const Thresholds& thresholds);

/// An explanation beside others: a candidate, or a parameter that is wrong.
struct RankedCandidate {
  EffectId effect;
  Place location;
  std::size_t index = 0;  ///< into the list of evidence that was ranked: singles, pairs, larger, or freed
  bool is_parameter = false;
  double chi2 = 0;
  double prior_chi2 = 0;  ///< of that, the squared priors of the parameters
  double log_prior = 0;   ///< log of its prior probability, up to a constant
  double probability = 0;
  std::vector<EffectAt> set = {};  ///< all effects of a set, in order; empty: its own alone
  EffectAt name() const { return {effect, location}; }
};

/// One a candidate, under the name of the last of its effects. Not yet ranked.
std::vector<RankedCandidate> unranked(const std::vector<CandidateEvidence>& candidates, const Thresholds& thresholds);
/// A parameter that is free of its tolerance. @param tolerances of the evidence
RankedCandidate unranked(const FreedEvidence& freed, std::size_t index,
                         const std::vector<ToleranceEvidence>& tolerances, const Thresholds& thresholds);

/// What candidates are weighed with.
struct Weighing {
  double colour = 1;      ///< of the noise
  double gap = 0;         ///< chi2 of the plant without these effects, above the floor
  double floor_chi2 = 0;  ///< number of values
  double dispersion = 1;  ///< of residuals, in units of the noise's variance
};

/// Keeps of each set of effects the most probable form, sets the probabilities, and sorts by them: log p = -(r^2 -
/// best) / (2 T) - z^2 / (2 sqrt(T / dispersion)) + log prior, chi2 = r^2 + z^2 (residuals and priors), T =
/// max(colour, dispersion) + of_gap gap + of_remains (best - (1 + floor_error) floor). No form in a catalogue is that
/// of the rig, so that every one leaves some share of the gap; T is how much of such a difference means nothing. Where
/// one closes the gap to the floor, of_gap_closed stands for of_gap: a wrong form seldom does that, and what leaves
/// more is less likely a right one. The parameters' tolerances are what their owner says, and count for more; but a
/// wrong form bends the parameters too. None is above `limit`.
///
/// The laws of instruments are nearly exact, those of dampers and springs are not. So sets that differ by the law of an
/// instrument alone (a delay or a lag of one sensor) keep the sum of their probabilities, and are weighed against each
/// other with of_gap_instruments in place of of_gap.
void rank(std::vector<RankedCandidate>& list, const Weighing& weighing, const Thresholds& thresholds);

/// Probabilities by what is left, for explanations whose noise is not known: p_i ~ (J_i / J_best)^(-blocks / 2), the
/// likelihood of residuals whose size each estimates and of which every block is worth one independent sample.
/// @param left J_i > 0   @return none above `limit`
Vector probabilities_by_leftover(ConstVectorRef left, Index blocks, double limit);

/// The least leftover, in units of the noise's power, that counts in the probabilities of places without a name. It
/// keeps their ratios finite where records hold no noise.
inline constexpr double kNothingLeft = 1e-3;

/// What an unknown signal at a location leaves, over what it leaves at the best place; 1 where it is not known. What
/// leaves less than the noise has explains noise as well, as any signal does in a short record: two such places are
/// alike.
double leftover_ratio(const std::vector<PlaceLeftover>& places, const Place& location);

/// Singles and, where it may be so, wrong parameters, ranked.
struct Contest {
  std::vector<RankedCandidate> ranked;
  Weighing weighing;
  bool effect_seen = false;     ///< a single gains more than chance does
  bool parameter_seen = false;  ///< chi2 falls by out_of_tolerance^2 once a parameter is free
};
Contest contest_of(const Evidence& evidence, const Thresholds& thresholds);
/// The contest among effects that close the gap by themselves, once no parameter is the answer; may be empty.
Contest contest_of_closing_effects(const Evidence& evidence, const Contest& all, const Thresholds& thresholds);

/// What a difference of chi2 by chance goes with: the colour of the noise, or the dispersion of residuals where that is
/// larger.
double chance_of(const Evidence& evidence);

/// Reduced chi-square - 1 up to which nothing counts as missing: `too_small`, or `floor_errors` standard errors of the
/// floor's power where that is more, as of a floor that is estimated from the records themselves.
double negligible(const Evidence& evidence, const Thresholds& thresholds);

/// Gap that is left by the re-tuned plant: reduced chi-square - 1, fitted and held-out records together.
double gap_left(const Evidence& evidence);

/// True if what a set of effects leaves enters at none of their places, by an unknown signal's leftover.
bool enters_elsewhere(const Evidence& evidence, const CandidateEvidence& set, const Thresholds& thresholds);
/// True if a parameter lies more than `not_home` tolerances off at a place where none of the set's effects acts: the
/// error of a form bends what belongs to its own place.
bool bends_elsewhere(const Evidence& evidence, const CandidateEvidence& set, const Thresholds& thresholds);
/// True if what a set leaves may be no more than the error of its forms.
bool within_form(const Evidence& evidence, const CandidateEvidence& set, const Thresholds& thresholds);
/// Whether what a set leaves is worth the search for one more effect: much of the gap, more than the noise, or anything
/// that enters elsewhere. Not beside a single effect that removes next to nothing.
bool worth_another(const Evidence& evidence, const CandidateEvidence& set, const Thresholds& thresholds);
/// True where these depend on `left_at_place` of the set, which is not known yet.
bool asks_left_at_place(const Evidence& evidence, const CandidateEvidence& set, const Thresholds& thresholds);
/// True if every other effect of a set at the place of this one is of the opposite kind, one elastic and one
/// dissipative, or one a factor of an instrument and one not; also where there is no other. Neither can be the error of
/// the other's form: what a spring's form does not fit is elastic too, and does no work in a cycle, whereas all that a
/// damper's does not fit is work.
/// @param which number of the effect
bool differs_in_kind(const CandidateEvidence& set, std::size_t which);
/// Whether an effect of a set removes enough of what the others leave to be named.
/// @param which number of the effect   @param chi2_without of the others   @param home as of `brings_home`
bool effect_needed(const Evidence& evidence, const CandidateEvidence& set, std::size_t which, double chi2_without,
                   const Thresholds& thresholds, bool home = false);
/// True if a parameter lies far off elsewhere without the last effect of a set, and none does with it: a factor that
/// the records hardly tell from the parameters is told by their tolerances alone.
bool brings_home(const Evidence& evidence, const CandidateEvidence& before, const CandidateEvidence& set,
                 const Thresholds& thresholds);
/// Sets of one effect more than `before`, ranked.
std::vector<RankedCandidate> ranked_sets(const Evidence& evidence, const std::vector<CandidateEvidence>& sets,
                                         const CandidateEvidence& before, const Thresholds& thresholds);

/// Other parameters that leave their tolerances although that of the freed one is free, as "NAME (-7.4 tolerances)", or
/// nothing. Where a law's bend is wrong, all that shapes its element bends with it.
std::string others_out(const Evidence& evidence, const FreedEvidence& freed, const Thresholds& thresholds);

/// Log of the density of the size of a wrong parameter, up to a constant: a Cauchy distribution of scale `wrong_by`.
/// Its heavy tails allow one that is far off, and hold the nearer for more probable of two that explain the same.
/// @param size deviation from the plant file, in tolerances
double log_size_prior(double size, const Thresholds& thresholds);

/// Probability of each parameter set free beside a candidate to be the one that is wrong: that one of n parameters is,
/// which it is with probability `one_wrong`, times this one's share among those that were set free,
///   p_i = w_i / sum_k w_k / (1 + exp(-min(W, L) / 2 + log(n wrong_by / one_wrong))),
///   w_i = exp((P + D / c) / 2 + log_size_prior(theta)),
/// where P is what the priors of the other parameters fall by, D what the residuals fall by over the dispersion, and
/// L = P + D the likelihood ratio, which does not change for a parameter that moved far along what the records do not
/// tell. W = theta^2 / (1 + v + c (std^2 - v)) is Wald's statistic of its deviation against its tolerance, v the part
/// of its variance that the other tolerances leave open. c = sqrt(colour) + r / directions is how far the records tell
/// less than white noise would let them: coloured noise makes the rest up to `colour` times larger than white noise of
/// its power does, and not at all where the parameter shows at its quiet frequencies: the geometric mean is a
/// judgement. r, the chi2 that is left above the floor, is the work of a form that is not the rig's. It bends
/// parameters as noise does, those the most that the records tell the least.
std::vector<double> probabilities_beside(const Evidence& evidence, const CandidateEvidence& candidate,
                                         const Thresholds& thresholds);

/// True if the gap closes with the parameter free, and no other one leaves its tolerance.
bool parameter_explains(const Evidence& evidence, const FreedEvidence& freed, const Thresholds& thresholds);

}  // namespace wheelhop
