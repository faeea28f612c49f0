/// \file
/// One row of a sweep: a cell's config on one realisation.
#pragma once

#include "experiments/sweep/grid.hpp"

namespace wheelhop {

/// The row: `cell`, `realisation`, one column an axis, `seed`, `config_hash`, `status`, `message` and what the measure
/// calls for, all flat. A failure is a row as well. Deterministic: the same build writes the same bytes.
Json compute_row(const Grid& grid, std::size_t cell, Index realisation);

}  // namespace wheelhop
