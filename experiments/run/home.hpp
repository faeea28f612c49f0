/// \file
/// Where the files that come with the program are: presets and the figures' scripts.
#pragma once

#include <filesystem>

namespace wheelhop {

/// The repository: $WHEELHOP_HOME where it is set, else the folder the program was built from. UserError if neither
/// holds the presets.
std::filesystem::path home();

}  // namespace wheelhop
