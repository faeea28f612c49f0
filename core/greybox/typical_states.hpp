/// \file
/// Where the records of a fit may begin, and how large the states of a plant are, before anything is fitted.
#pragma once

#include <optional>
#include <vector>

#include "core/greybox/fit_record.hpp"
#include "core/optimise/solver.hpp"

namespace wheelhop {

/// States of a plant under its records: their sizes, and in these where each record may begin, 2n a record.
struct TypicalStates {
  Vector scale;  ///< 2n: RMS under the drives, or what a free decay begins with
  Vector rest;   ///< in equilibrium
  Vector begin;  ///< the same, or where a drive never moves the state that its readings tell
};

/// What a state of this plant is in size under its drives, seen in a simulation from rest. None where one fails.
std::optional<TypicalStates> typical_states(const Plant& plant, const std::vector<FitRecord>& records,
                                            const Solver& solver);

}  // namespace wheelhop
