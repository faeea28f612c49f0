/// \file
/// How much each of several effects contributes where they are named together.
#pragma once

#include <vector>

#include "core/gap/which/hypothesis.hpp"

namespace wheelhop {

/// Shapley's value of every player of a game: what it adds to those before it, averaged over all orders,
///   phi_i = sum over S without i of |S|! (n - |S| - 1)! / n! (v(S + i) - v(S)).
/// They sum to v(all) - v(none), are equal for players that add the same everywhere, and 0 for one that adds nothing.
/// (Shapley 1953, "A value for n-person games".)
/// @param worth v, 2^n values; bit i of the index says whether player i is in   @return n
/// Throws std::invalid_argument if the number of values is no power of two. Cost n 2^n.
Vector shapley_values(ConstVectorRef worth);

/// Share of the gap that each effect of a hypothesis removes, whatever the order in which they are added: Shapley's
/// value with v(S) = 1 - (J_S - 1) / (J_none - 1), J_S the misfit of the held-out records for the plant with the
/// effects S, its parameters and tolerances fitted anew. They sum to the closure of all effects together. A share is
/// negative where an effect, without the others, mostly makes things worse.
/// @param none re-tuned plant, linearised   @param all with n effects, `none` its base
/// @param known hypotheses of one effect that were fitted before: the best one of an effect is not fitted again
/// @return n; empty where there is no gap, or a plant with some of the effects does not follow the drives
/// Cost: a fit for each of the 2^n - 2 subsets that is not known, from where `all` has its parameters.
Vector effect_shares(const Study& study, const Hypothesis& none, const Hypothesis& all,
                     const std::vector<Hypothesis>& known);

}  // namespace wheelhop
