/// \file
/// Channels in another unit or of another sign than the plant's: before anything is explained, is it the same quantity?
#pragma once

#include <vector>

#include "core/gap/verdict/evidence.hpp"
#include "core/greybox/plant_fit.hpp"

namespace wheelhop {

/// Channels whose `reads` lies outside 1/2 ... 2 although they go with the plant (|correlation| > 0.8): millimetres for
/// metres, g for m/s^2, a sensor mounted upside down. Far beyond any gain error, and no fit should bend the plant to
/// it.
/// @param fit of the plant as delivered over `records`
std::vector<WrongScale> wrong_scales(const PlantFit& fit, const std::vector<FitRecord>& records);

}  // namespace wheelhop
