/// \file
/// One row of a sweep: a cell's config on one realisation.
#pragma once

#include "experiments/sweep/grid.hpp"

namespace wheelhop {

/// The row: `cell`, `realisation`, one column an axis, `seed`, `config_hash`, `status`, `message` and what the measure
/// calls for, all flat. A failure is a row as well. Deterministic: the same build writes the same bytes.
Json compute_row(const Grid& grid, std::size_t cell, Index realisation);

/// Whether a row may hold a column of this name beside its axes, under any measure. An axis must have another name, but
/// for `seed`, which is the same number.
bool is_row_column(const std::string& name);

}  // namespace wheelhop
