/// \file
/// Channels in another unit or of another sign than the plant's: what their factors say.
#pragma once

#include <string>
#include <vector>

#include "core/gap/verdict/evidence.hpp"

namespace wheelhop {

/// True if one factor is wrong: that of a single channel, or of the drive where all channels, two or more, are off
/// alike. @param channels of the plant
bool one_scale(const std::vector<WrongScale>& wrong, std::size_t channels);

/// Tells the factors and what to check. Empty without any. @param channels of the plant
std::string scale_message(const std::vector<WrongScale>& wrong, std::size_t channels);

}  // namespace wheelhop
