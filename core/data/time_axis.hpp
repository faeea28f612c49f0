/// \file
/// Is a column of instants the uniform grid it claims to be?
#pragma once

#include <filesystem>

#include "core/base/linalg.hpp"

namespace wheelhop {

/// Checks instants `t_s` (N >= 2, in seconds) against the rate, as load_records describes.
/// @param file names the file in messages   @param first sample of the file that t_s(0) is
/// UserError naming the line: not increasing, not uniform; or both rates where they differ.
void check_time_axis(ConstVectorRef t_s, double sampling_hz, const std::filesystem::path& file, Index first);

}  // namespace wheelhop
