/// \file
/// Hypotheses with one effect more: which of the catalogue are worth a fit beside those that a hypothesis has, their
/// quick fits, and what of these is fitted on.
#pragma once

#include <vector>

#include "core/base/place.hpp"
#include "core/gap/which/hypothesis.hpp"
#include "core/gap/which/screen.hpp"

namespace wheelhop {

/// What of the fast screen is worth a fit.
struct ExtendOptions {
  Index shortlist = 10;              ///< fits at most, the best of the screen first
  Index forms = 3;                   ///< of one effect at one place, by first labels
  double worth = 0.1;                ///< screened gain over the best one's, below which a candidate is not fitted
  double least = 0;                  ///< fall of chi2 that the screen must expect of the best for any to be fitted
  const PlantFit* around = nullptr;  ///< whose plant the screen looks at; null: that of the base
  const std::vector<Hypothesis>* tried = nullptr;  ///< forms that are not tried again
};

/// Adds one effect to a hypothesis in all ways that the fast screen finds worth a fit: a quick one each. No effect is
/// added a second time at its place, by the first labels of its form and of those that are there, nor one that moves
/// what is moved already.
/// @param base linearised   @param known, found as of `screen`
/// @return by chi2, ascending. Not linearised. Fits run side by side; the result does not depend on how many.
/// Cost: a simulation of every fitted record a candidate, and `shortlist` quick fits.
std::vector<Hypothesis> extend(const Study& study, const Hypothesis& base, const ExtendOptions& options,
                               const Changes& known = {}, Changes* found = nullptr);

/// A quick fit of each candidate of a shortlist.
/// @param candidates that the shortlist counts   @return as `extend`
std::vector<Hypothesis> fit_shortlist(const Study& study, const Hypothesis& base,
                                      const std::vector<EffectCandidate>& candidates,
                                      const std::vector<Screened>& shortlist);

/// Fits the forms that refine those of a list, of given names. A finer form takes over the label of the form that it
/// refines where it removes more than a share of what that one leaves. The coarser form stays under its other labels,
/// and leaves the list when it has none left.
/// @param base of all in the list   @param names effects at their places   @param list in any order, on return by chi2
/// @return true if one did. Cost: some patient fits a form.
bool refine(const Study& study, const Hypothesis& base, const std::vector<EffectAt>& names, double share,
            std::vector<Hypothesis>& list);

/// Fits the best of a list of quick fits on to the end, by the thorough solver. Those that lie far behind the first,
/// and by more than a quick fit tells, stay as they are.
/// @param before chi2 without their last effect   @param most fits
/// @param list by chi2, ascending; so on return too, with the best fit of each form. Fits of one form from several
/// sizes that quick fits do not tell apart are all fitted on.
void finish(const Study& study, double before, std::size_t most, std::vector<Hypothesis>& list);

}  // namespace wheelhop
