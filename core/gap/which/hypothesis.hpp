/// \file
/// Hypotheses of what a plant lacks: none, one or several effects, each fitted to the estimation records and scored on
/// the held-out ones.
#pragma once

#include <functional>
#include <limits>
#include <vector>

#include "core/gap/evidence/prepared.hpp"
#include "core/gap/which/effect.hpp"

namespace wheelhop {

/// A plant with the effects that it may lack, its parameters t (in scales, from `start` on) the most probable ones:
///   min over t and initial states of sum r^2 + sum (t_k / prior_std_k)^2,   r = (yhat - y) ./ noise floor,
/// over the fitted records in free run; a tolerance of the plant file is a prior of standard deviation 1. Without such
/// priors a plant bends around whatever it lacks: Brynjarsdottir & O'Hagan 2014, Inverse Problems 30, 114007.
struct Hypothesis {
  std::vector<EffectCandidate> effects;  ///< in the order in which they were added; each one's plant has those before
  std::vector<FitParameter> parameters;  ///< tolerances first, then those of the effects in their order
  Plant start;                           ///< the plant with all effects at which every t is 0
  PlantFit fit;                          ///< of the fitted records
  PlantFit held_out;                     ///< of the held-out records, by their initial states alone
  GapStage stage;                        ///< what `held_out` leaves
  /// Sum r^2 over the fitted and, if they are apart, the held-out records, + sum (t / prior_std)^2; where the held-out
  /// records fit much worse, at the parameters that fit all records best. Infinite where a simulation of either failed;
  /// `fit.error` is empty then.
  double chi2 = std::numeric_limits<double>::infinity();
  double prior_chi2 = 0;  ///< of that, the last sum: how far the parameters left their tolerances
};

/// Share of a channel's reading that re-tuning leaves, from which the plant is far from its records: a judgement. A
/// channel of the other sign leaves more of what its drive makes, or of its own reading.
inline constexpr double kFarOff = 0.2;
/// True if the plant is far from the held-out records in a channel.
bool far_off(const Hypothesis& hypothesis);

/// True if one of a fit's `count` leading parameters, those with tolerances, went as far as it may.
bool stopped(const PlantFit& fit, Index count);

/// Every effect at every place of a plant, in all its forms, to start at sizes that suit the operation. Anything may
/// stand behind it: the whole catalogue, or one with families left out to see whether a diagnosis then says "none".
using CandidateList = std::function<std::vector<EffectCandidate>(const Plant&, const Operation&)>;

/// Share of its cost by which a step of a quick fit lowers it at least, or the fit ends: fits that differ by less are
/// not told apart by quick ones. A judgement.
inline constexpr double kQuickDecrease = 2e-3;

/// The solvers of least squares, by how much a fit is worth. Simulations are nearly all of the cost, and a
/// Jacobian of all parameters takes as long as four or five of them.
struct GapSolvers {
  const Solver& quick;     ///< for many fits of which most are dropped; ends by kQuickDecrease
  const Solver& thorough;  ///< for those that stay
  const Solver& patient;   ///< for all parameters at once, far from where they count
};

/// Everything that fitting a hypothesis reads; kept by reference, it outlives the study.
struct Study {
  const Plant& nominal;  ///< as delivered
  const GapData& data;
  const GapSolvers& solvers;
  const CandidateList& candidates;
  std::vector<FitParameter> tolerances;  ///< tolerance_parameters(nominal)
  Index iterations = 12;                 ///< cap of a thorough fit; a quick one gets fewer, a patient one more
};

/// The plant itself with some parameters free. Linearised. Where parameters stop at their ends far from the records, it
/// is fitted once more, by continuation from the plant as delivered. Where the solution does not follow all records, or
/// has no derivatives, on the way back from it to `plant`; `fit.error` is empty where nothing there does either. Cost:
/// up to four times the study's iterations, each a Jacobian. Takes all threads.
Hypothesis fit_hypothesis(const Study& study, const Plant& plant, std::vector<FitParameter> parameters);

/// The plant of a hypothesis, from its solution on, with other priors. Not linearised.
Hypothesis fit_from(const Study& study, const Hypothesis& base, std::vector<FitParameter> parameters);

/// Some of the effects of a hypothesis, fitted from the values and the initial states that it has with all of them, the
/// plant as it is there and as it was delivered. A fit without an effect that did nothing is thus as good as the one
/// with it.
/// @param none without effects   @param all with n effects, `none` its base   @param members bit i: effect i is in
/// @return `fit.error` empty where a plant without the others has no place for an effect or nothing that it corrects,
/// or a simulation failed. Not linearised. Cost: two thorough fits.
Hypothesis fit_subset(const Study& study, const Hypothesis& none, const Hypothesis& all, std::size_t members);

/// An effect and the values of its parameters.
struct SizedEffect {
  EffectCandidate effect;
  std::vector<double> values;
};

/// One effect of a fit, by its number.
SizedEffect sized_effect(const Hypothesis& of, std::size_t number);

/// fit_subset() of effects that may come from different fits.
/// @param near  fit from whose tolerated parameters and initial states it begins
Hypothesis fit_set(const Study& study, const Hypothesis& none, const std::vector<SizedEffect>& effects,
                   const Hypothesis& near);

/// True if two hypotheses have the same model forms at the same places, in the same order.
bool same_forms(const std::vector<EffectCandidate>& a, const std::vector<EffectCandidate>& b);

}  // namespace wheelhop
