/// \file
/// A Gaussian prior on the parameters of a least-squares problem.
#pragma once

#include <memory>

#include "core/optimise/solver.hpp"

namespace wheelhop {

/// The problem with the further residuals sqrt(precision_i) (theta_i - mean_i): minimising it is a maximum a posteriori
/// estimate (Tikhonov & Arsenin 1977). Residuals with precision 0 are there and zero.
/// @param problem outlives the result   @param mean, precision one value a parameter; precision >= 0, in units of
/// 1/theta^2 times the variance of the residuals
std::unique_ptr<ResidualProblem> with_prior(const ResidualProblem& problem, ConstVectorRef mean,
                                            ConstVectorRef precision);

/// 2 cost / residuals at theta: the residuals' variance, in which a prior is weighed. 0 outside the domain.
double residual_variance(const ResidualProblem& problem, ConstVectorRef theta);

}  // namespace wheelhop
