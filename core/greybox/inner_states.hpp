/// \file
/// Inner states of a plant, in the order of `inner_state_names`: what laws remember, and what AC couplings have stored.
#pragma once

#include <vector>

#include "core/greybox/fit_record.hpp"

namespace wheelhop {

/// An initial state in which each coupling that is not listed has stored its reading at rest, in equilibrium under the
/// first sample of the record's drive. A coupling that ran before the record began has stored something else, which a
/// fit finds. Where the plant cannot rest the state is returned as it is. Cost: a simulation of one sample, if anything
/// is missing.
InitialState with_stored(const Plant& plant, const FitRecord& record, InitialState state);

/// What an inner state of this plant is in size under its drives, seen in a simulation from given states: the RMS of
/// what a law remembers, and of what a coupling stores beyond its reading at rest, over the record in which it is
/// largest. What a coupling stores during a record says what it may have stored before; of one that is slow against the
/// record that is little, and it stands for no bias. A fit that moves the corner keeps the scale of where it began.
/// Empty where a simulation fails. Cost: a simulation of each record.
/// @param rest of each record, by `with_stored`
Vector typical_inner_states(const Plant& plant, const std::vector<FitRecord>& records,
                            const std::vector<InitialState>& initial_states, const std::vector<InitialState>& rest);

}  // namespace wheelhop
