/// \file
/// Inner states of a plant, in the order of `inner_state_names`: what laws remember, and what AC couplings have stored.
#pragma once

#include <vector>

#include "core/greybox/fit_record.hpp"

namespace wheelhop {

/// An initial state in which each coupling that is not listed has stored its reading at rest, in equilibrium under the
/// first sample of the record's drive, or 0 where the plant cannot rest there. A coupling that ran before the record
/// began has stored something else, which a fit finds. Cost: a simulation of one sample, if anything is missing.
InitialState with_stored(const Plant& plant, const FitRecord& record, InitialState state);

/// Size of each inner state, in the order of `inner_state_names`: the scale of their priors.
///
/// Of a law it is the RMS of what it remembers, in a simulation from given states. Of a coupling it is the RMS of
/// w(t) - w(0), w what it has stored: w' = a (x - w), a = 2 pi high_pass_hz, and the record holds y = x - w, so that
/// w(t) - w(0) = a int_0^t y. What it stores during a record says what it may have stored before. In a record that is
/// short against 1 / a that is little, so that no slow coupling stands for a bias. A fit that moves the corner keeps
/// the size of where it began.
/// @param initial_states one a record
/// @return s, each the largest over the records; empty where a simulation fails. Cost: a simulation of each record, if
/// there is a law with memory.
Vector typical_inner_states(const Plant& plant, const std::vector<FitRecord>& records,
                            const std::vector<InitialState>& initial_states);

}  // namespace wheelhop
