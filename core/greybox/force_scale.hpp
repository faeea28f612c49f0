/// \file
/// The common factor of all forces, which motion alone does not tell.
#pragma once

#include <vector>

#include "core/greybox/plant_fit.hpp"

namespace wheelhop {

/// M q'' = F(q, q', u): with every mass, stiffness, damping and load of a plant times one factor s, and with the gain
/// of a force drive times it, the same motion follows from the same records. Only priors tell s, and a fit that has
/// wandered along it comes home slowly, as all of these numbers have to move together.
/// @param plant fitted: the values from which s counts   @param start where theta counts from   @param theta of the fit
/// @return theta with the s at which the priors, sum (theta / prior_std)^2, are least; theta itself where the records
/// tell forces (a force sensor, a force drive whose gain is not fitted, or whose path is not linear), where a number
/// that belongs to them is not fitted, or where one would move farther than `kFarthest` or below its `least`.
Vector with_force_scale_at_home(const Plant& plant, const Plant& start, const std::vector<FitParameter>& parameters,
                                const Vector& theta);

}  // namespace wheelhop
