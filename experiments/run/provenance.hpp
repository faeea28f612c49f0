/// \file
/// What made a result: the program, not the machine and not the hour.
#pragma once

#include "core/base/json.hpp"
#include "core/data/records.hpp"

namespace wheelhop {

/// `{"program", "version", "commit", "compiler", "flags", "eigen"}`. The commit is the one at which the build was
/// configured; `-dirty` behind it tells of changes since, "unknown" stands outside a repository.
Json provenance();

/// The same with `"reading": [{"record": 0, "file": "...", "did": ["...", ...]}]`: what was done to files to read them
/// (reading.hpp), for the records whose files were not plain; without the member if all were.
Json provenance(const RecordSet& set);

}  // namespace wheelhop
