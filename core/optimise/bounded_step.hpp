/// \file
/// Steps of least squares inside bounds, for every solver of the family.
#pragma once

#include "core/optimise/solver.hpp"

namespace wheelhop {

/// Levenberg-Marquardt's damping, in the scales of the parameters, from which a step is lost in rounding.
inline constexpr double kMostDamping = 1e12;

/// The point of a box nearest to theta.
Vector clamped(ConstVectorRef theta, const Box& box);

/// The components of a gradient along which theta may go down: zero where theta stands at a bound and would leave it.
Vector projected_gradient(ConstVectorRef gradient, ConstVectorRef theta, const Box& box);

/// min over s of  gradient's + 1/2 s'H s  with theta + s in the box, by Newton steps on the components that are free,
/// which change until none gains (Bertsekas 1982).
/// @param H n x n, positive definite, lower triangle   @param gradient, theta n, theta inside the box
/// @return n; zero where H or the gradient is not finite and the box has bounds. Cost: one factorisation without
/// bounds, else one or two more for every bound that is reached.
Vector bounded_step(const Matrix& H, ConstVectorRef gradient, ConstVectorRef theta, const Box& box);

/// min over x of  ||A x - b||  with x in the box, by such a step from the point nearest to 0.
/// @param A N x n, N >= n   @param b N   @param box with bounds
Vector bounded_least_squares(ConstMatrixRef A, ConstVectorRef b, const Box& box);

}  // namespace wheelhop
