/// \file
/// One fit of a hypothesis with its score: the steps of which all fits of a search are made.
#pragma once

#include "core/gap/which/hypothesis.hpp"

namespace wheelhop {

/// Iterations of a patient fit over those of a thorough one. Far from the plant as delivered a fit of all parameters
/// first loses itself in what the data hardly tell. A judgement.
inline constexpr Index kPatient = 4;

/// Fits from `hypothesis.start` and scores; false where a simulation failed, of the held-out records as well.
bool fit_quickly(const Study& study, const Solver& solver, const FitOptions& fitted, const FitOptions& held_out,
                 Hypothesis& hypothesis);

/// The same for a fit that stays: its held-out records are weighed with what it does not know of its parameters.
///
/// chi2 of the held-out records given the fitted ones is that of all records at the parameters which fit all best, less
/// that of the fitted ones: sum r' (I + J S J')^-1 r for a linear plant, S the covariance of the parameters. A record
/// that reaches further than the fitted ones tells parameters which these did not, and cannot refute them.
bool complete(const Study& study, const Solver& solver, const FitOptions& fitted, const FitOptions& held_out,
              Hypothesis& hypothesis);

/// Sum of r^2 and of the squared priors where a fit would start; infinite where the plant does not follow.
double cost_of_start(const Study& study, const Hypothesis& base, const Plant& start, const Vector& theta);

/// Where the records of a fit begin, and nothing else of it: another plant may start from there.
PlantFit states_of(const PlantFit& fit);

}  // namespace wheelhop
