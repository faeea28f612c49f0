/// \file
/// Forward selection of what a plant may lack: every effect at every place alone, wrong parameters, pairs of effects
/// where one is not enough, and so on. Fills the part of the evidence that fits of candidates tell.
#pragma once

#include <functional>
#include <vector>

#include "core/gap/evidence/closure.hpp"
#include "core/gap/verdict/evidence.hpp"
#include "core/gap/verdict/thresholds.hpp"
#include "core/gap/which/extend.hpp"

namespace wheelhop {

/// What of the search is worth its time. Nothing here turns evidence into an answer, but what is not fitted cannot be
/// named. Each is a judgement: larger (or, of shares, smaller) values find the same on generated cases, and take
/// longer.
struct SearchEffort {
  double screened = 0.25;     ///< of `notice`, what the screen must expect of the best candidate for any to be fitted
  Index fits = 10;            ///< quick fits of singles
  double leaves_much = 0.06;  ///< of the gap that the best of these leaves, from which others are fitted that the
                              ///< screen expects less of: as `worth_second`
  double large_gap = 1;       ///< reduced chi-square - 1 of the re-tuned plant, from which a gap without a name is
                              ///< worth those others beside a corrected instrument, and modes on masses
  double beyond_noise = 2;    ///< misfit of the best fit, from which all is fitted once more with residuals expected
                              ///< of that size
  Index places_by_force = 4;  ///< places at which the unknown force is asked what law it is, or what hangs on a mass
  Index sized_by_force = 6;   ///< laws whose sizes are fitted to it
  Index fits_by_force = 3;    ///< quick fits of the whole plant with those that make most of it
  double made_by_law = 0.5;   ///< share of it that a law makes, from which it is fitted
  double made_whole = 0.9;    ///< and from which no other place is asked; likewise of the force that an answer's
                              ///< element makes, from which another law is a rival
  Index fits_at_home = 3;     ///< quick fits of those that are expected most of around the plant as delivered
  Index finished = 4;         ///< of these, the best that are fitted on to the end
  double freeing_z = 2;       ///< z of a parameter from which parameters are fitted without their tolerances
  double freed_z = 1;         ///< and of those that then are
  double stands_out = 0.5;    ///< probability of one parameter to stand out, from which it is
  double beside_z = 3;        ///< z of a parameter beside an effect, from which it is set free
  std::size_t beside = 3;     ///< parameters set free beside an effect, each alone, at most
  std::size_t firsts = 2;     ///< effects to which a second one is tried
  Index second_fits = 5;      ///< quick fits of a second effect to each
  double second_worth = 0.2;  ///< screened gain over the best one's, below which a second effect is not fitted
  double second_screened = 0.025;  ///< share of what is left that the screen must expect of a second effect: of a mode
                                   ///< it knows a wrong frequency alone
  double far_behind = 3;           ///< of what the best first effect leaves, beyond which another is no part of a pair
  double closed = 0.1;             ///< of what a first effect leaves, what a pair may leave for no other to be tried
  Index finished_pairs = 3;        ///< of the quick fits of pairs, the best that are fitted on to the end
  std::size_t exchanged = 3;       ///< other laws of an instrument with which the best pair is fitted once more
  int searches = 2;                ///< for a second effect, where the first one's fit became better by it
  std::size_t most_effects = 4;    ///< in an answer
  int growths = 4;                 ///< searches for a further effect beside two or more

  /// Calls visit(name, value).
  template <class V>
  void fields(V&& visit) {
    visit("screened", screened);
    visit("fits", fits);
    visit("leaves_much", leaves_much);
    visit("large_gap", large_gap);
    visit("beyond_noise", beyond_noise);
    visit("places_by_force", places_by_force);
    visit("sized_by_force", sized_by_force);
    visit("fits_by_force", fits_by_force);
    visit("made_by_law", made_by_law);
    visit("made_whole", made_whole);
    visit("fits_at_home", fits_at_home);
    visit("finished", finished);
    visit("freeing_z", freeing_z);
    visit("freed_z", freed_z);
    visit("stands_out", stands_out);
    visit("beside_z", beside_z);
    visit("beside", beside);
    visit("firsts", firsts);
    visit("second_fits", second_fits);
    visit("second_worth", second_worth);
    visit("second_screened", second_screened);
    visit("far_behind", far_behind);
    visit("closed", closed);
    visit("finished_pairs", finished_pairs);
    visit("exchanged", exchanged);
    visit("searches", searches);
    visit("most_effects", most_effects);
    visit("growths", growths);
  }
};

using Step = std::function<void(const std::string&)>;

/// What a search reads; kept by reference.
struct Search {
  const Study& study;
  const Thresholds& thresholds;
  const SearchEffort& effort;
  const Bootstrap& bootstrap;   ///< of closures
  const Hypothesis& delivered;  ///< the plant as delivered, or with gross faults corrected
  const Hypothesis& retuned;    ///< inside its tolerances
  const Step& step;
};

/// A single that a search for pairs has read.
struct ReadSingle {
  EffectAt name;
  std::vector<EffectCandidate> effects;
  double chi2 = 0;
};

/// Fits, and the candidates for an answer: one for each fit and each way to name its effects.
struct Candidates {
  std::vector<Hypothesis> fits;
  std::vector<CandidateEvidence> evidence;  ///< of the candidates; `fit` of each is an index into `fits`
  std::vector<Hypothesis> alone;            ///< of the best pair: either effect fitted alone
  std::vector<ReadSingle> read;             ///< of pairs: the singles on which their search depended
  /// @param candidate index into `evidence`
  Hypothesis& fit_of(std::size_t candidate) { return fits[evidence[candidate].fit]; }
  const Hypothesis& fit_of(std::size_t candidate) const { return fits[evidence[candidate].fit]; }
};
struct FreedParameters {
  std::vector<Hypothesis> fits;  ///< linearised; `fit.error` empty where a fit failed
  std::vector<FreedEvidence> evidence;
};

/// Values and standard deviations of a fit's parameters from number `first` on; 0 where it is not linearised.
std::vector<FittedParameter> fitted_parameters(const PlantFit& fit, const std::vector<FitParameter>& list,
                                               std::size_t first);
/// What a fit of one or more effects tells, under each way to name them.
/// @param number index of the fit in Candidates::fits
std::vector<CandidateEvidence> evidence_of(const Search& search, const Hypothesis& hypothesis, std::size_t number);

/// Adds a fit and its candidates.
void add_candidates(const Search& search, Hypothesis hypothesis, Candidates& candidates);

/// Once a hypothesis is linearised: standard deviations of its sizes, and z of its tolerances.
void add_linearisation(const Search& search, const Hypothesis& hypothesis, CandidateEvidence& evidence);

/// Every effect at every place, by the fast screen, of which the best are fitted; ascending by chi2.
/// @param changes out, what candidates change around the re-tuned plant, as of `screen`
Candidates find_singles(const Search& search, double colour, Changes& changes);

/// Fits as many effects again that the screen expects less of, for gaps that no answer explained. The screen is
/// linear, around a plant that may be bent by what is missing.
/// @param around the plant of the screen; null: the re-tuned one
/// @param singles gets them, in their order   @return false if there was none, or nothing was added
bool add_less_expected(const Search& search, double colour, const PlantFit* around, Candidates& singles);

/// Fits the laws that make most of the unknown force at the best places, see force_screen.hpp.
/// @param places ascending by leftover; none (where one channel alone was measured): all elements
/// @param singles, return as above
bool add_by_force(const Search& search, const std::vector<PlaceLeftover>& places, Candidates& singles);

/// Fits what may hang on the masses at which an unknown force leaves least: every such candidate from its own sizes,
/// in the re-tuned plant and in the plant as delivered. A mass on a spring near a resonance splits that in two, which
/// bends the re-tuned plant far, and no linear step leads there.
/// @param places, singles, return as above   Cost: two quick fits for each mass and frequency at which a mode may lie.
bool add_at_masses(const Search& search, const std::vector<PlaceLeftover>& places, Candidates& singles);

/// Fits other laws that make the force of an answer's elements, see `screen_rivals`: an answer is named beside those
/// that it can be mistaken for.
/// @param answer a fit with effects   @param singles, return as above
bool add_rivals(const Search& search, const Hypothesis& answer, Candidates& singles);

/// Fits those few that the screen around another plant expects most of.
/// @param singles, return as above
bool add_best_expected(const Search& search, double colour, const PlantFit& around, Candidates& singles);

/// Fits the finer forms of effects of given names as `refine` does.
/// @return true if one took over a label
bool refine_singles(const Search& search, const std::vector<EffectAt>& names, Candidates& singles);

/// Names of the singles that remove something of the gap and do not leave far more than the best one.
/// @param singles ascending by chi2
std::vector<EffectAt> worth_refining(const Search& search, const Candidates& singles);

/// Parameters of the re-tuned plant set free of their tolerances, side by side.
/// @param which numbers of tolerances
FreedParameters free_parameters(const Search& search, const std::vector<std::size_t>& which);
/// Those that may be the answer where no effect is: far enough from their tolerances, or standing out from the others.
std::vector<std::size_t> parameters_to_free(const Search& search, const Evidence& evidence);

/// Sets parameters free beside the effects of an answer, each alone and side by side: of those whose leave-prior-out z
/// is above `beside_z` the few that promise most, a size far out counting for less (`log_size_prior`). Masses,
/// stiffnesses and damping at rest alone: what else shapes a law bends with an effect.
/// @param tolerances of the evidence   @param answer linearised by this
/// @param candidate evidence of the answer; gets its linearisation, and what each freed parameter tells
/// @return a fit for each of its freed parameters, linearised
std::vector<Hypothesis> free_beside(const Search& search, const std::vector<ToleranceEvidence>& tolerances,
                                    Hypothesis& answer, CandidateEvidence& candidate);

/// Looks for a second effect beside the best first ones, and refits both effects of the best pair alone; where one of
/// them then is enough, it joins the singles, and the search goes on from there.
/// @param before what an earlier search among fewer singles found, which is returned if it depended on the same of
/// them: the first effects, and all at the instruments of the best pair
/// @param evidence without pairs; its singles those of `singles`, both may grow
/// @return the pairs, ascending by chi2; none where no second effect is worth a search
Candidates find_pairs(const Search& search, const Changes& changes, Candidates before, Evidence& evidence,
                      Candidates& singles);

/// Sets of two effects, and of more.
struct EffectSets {
  Candidates pairs, larger;
  Candidates& of(std::size_t count) { return count == 2 ? pairs : larger; }
};

/// Looks for one more effect beside two or more, where what they leave is worth it, and refits the best set without
/// each of its effects. Where one of these can be spared, the set without it joins those of its size (sequential
/// floating forward selection: Pudil, Novovicova and Kittler 1994, Pattern Recognition Letters 15, 1119).
/// @param number of the candidate that grows, among `sets.of(count)`; it gets what is left at its places
/// @param pending the set is not named without more, so that anything above chance is worth it
/// @return false if there was none
bool grow(const Search& search, const Evidence& evidence, std::size_t count, std::size_t number, bool pending,
          EffectSets& sets);

}  // namespace wheelhop
