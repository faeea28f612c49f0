/// \file
/// What made a result: the program, not the machine and not the hour.
#pragma once

#include "core/base/json.hpp"

namespace wheelhop {

/// `{"program", "version", "commit", "compiler", "flags", "eigen"}`. The commit is the one at which the build was
/// configured; `-dirty` behind it tells of changes since, "unknown" stands outside a repository.
Json provenance();

}  // namespace wheelhop
