/// \file
/// Channels in another unit or of another sign than the plant's: before anything is explained, is it the same quantity?
#pragma once

#include <string>
#include <vector>

#include "core/gap/plant_fit.hpp"

namespace wheelhop {

/// A channel that follows the plant at another scale.
struct WrongScale {
  std::string channel;
  double reads = 1;  ///< of what the plant makes of the drive, y ~ reads * y_plant by least squares
};

/// Channels whose `reads` lies outside 1/2 ... 2 although they go with the plant (|correlation| > 0.8): millimetres for
/// metres, g for m/s^2, a sensor mounted upside down. Far beyond any gain error, and no fit should bend the plant to
/// it.
/// @param fit of the plant as delivered over `records`
std::vector<WrongScale> wrong_scales(const PlantFit& fit, const std::vector<FitRecord>& records);

/// True if one factor is wrong: that of a single channel, or of the drive where all channels, two or more, are off
/// alike. @param channels of the plant
bool one_scale(const std::vector<WrongScale>& wrong, std::size_t channels);

/// Tells the factors and what to check. Empty without any. @param channels of the plant
std::string scale_message(const std::vector<WrongScale>& wrong, std::size_t channels);

}  // namespace wheelhop
