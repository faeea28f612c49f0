/// \file
/// Gross faults of instruments, seen before anything is explained: another unit, another sign, gravity in a reading, a
/// clock that runs at another rate. A fit would bend the plant far around them, and hide everything else.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "core/gap/verdict/evidence.hpp"
#include "core/greybox/plant_fit.hpp"

namespace wheelhop {

/// What a plant as delivered tells of its instruments, by the regression y = reads * y_plant + b of each channel over
/// the scored samples:
///   gain_error  `reads` outside 1/2 ... 2 although the channel goes with the plant (|correlation| > 0.8): millimetres
///               for metres, g for m/s^2, a sensor upside down. Of the drive where two or more channels, and no other,
///               are off alike; of the sensors where all channels are accelerometers off by the factor of g
///   gain_error  of one of several drives, before sensors are looked at: the factors g of the drives that fit all
///               channels best, min over g of sum_j |y_j - sum_i g_i y_ij|^2 / |y_j|^2 about the means, y_ij the
///               reading of channel j under drive i alone; where they explain 0.8^2 of all channels, those outside 1/2
///               ... 2 without which a twentieth would be left unexplained
///   bias        of an accelerometer: more than half of its squared error, and a quarter of the RMS of its motion.
///               Nothing that stays in place has a mean acceleration, so that no plant can explain it
///   clock_skew  where no factor is off: all channels together lie later and later behind the plant, or before it, by
///               three samples or more over the record
/// @param fit of the plant as delivered over `records`
/// Cost: of several drives a simulation each, of the clock two FFTs a channel and record, of all else one pass over the
/// samples.
std::vector<InstrumentFault> gross_faults(const PlantFit& fit, const std::vector<FitRecord>& records);

/// Names of two sensors of one unit whose channels seem to be exchanged: about the means, the plant's reading i is
/// that of channel j and its reading j that of channel i, sum of |y_j - y_plant,i|^2 / |y_j|^2 over both below 1 -
/// 0.8^2 and below a tenth of what the channels leave as they are. Of several such pairs the one that leaves least;
/// empty names where there is none. @param fit as above   Cost: one pass over the samples.
std::pair<std::string, std::string> exchanged_channels(const PlantFit& fit, const std::vector<FitRecord>& records);

}  // namespace wheelhop
