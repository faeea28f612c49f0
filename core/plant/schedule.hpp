/// \file
/// Laws whose numbers follow a drive of kind "schedule": an adjustable damper with its voltage as a second input. In a
/// plant file
///   "inputs":   [..., {"name": "voltage", "kind": "schedule", "unit": "V", "range": [0, 5]}]
///   "elements": [{..., "laws": [{"law": "coulomb_friction", "force_n": 60, ...,
///                                "scheduled": {"by": "voltage", "slopes": {"force_n": 150}, "tolerance": 0.2}}]}]
/// the force of the friction is (60 N + 150 N/V u). The drive has a path like any other: the lag of a coil, a delay.
/// Numbers that are linear in the voltage behind a lag of first order are those of B. F. Spencer, S. J. Dyke, M. K.
/// Sain, J. D. Carlson, Phenomenological model for magnetorheological dampers, J. Eng. Mech. 123 (1997) 230.
#pragma once

#include <string>
#include <vector>

#include "core/plant/plant.hpp"

namespace wheelhop {

/// What laws see of a drive at u: a value beyond an end of its range counts as that end, so that a smooth curve which
/// overshoots a step does no harm.
double within_range(Range range, double u);

/// The law without schedule, its numbers those at the value u of the drive that it follows: values + slopes u.
Law law_at(const Law& law, double u);

/// The plants in which each drive of kind "schedule" stays at one end of its range, without schedules but with the same
/// inputs: 2^d of d such drives, the one with all at their high ends last. The plant alone if there are none.
std::vector<Plant> at_ends_of_schedules(const Plant& plant);

/// Empty, or a sentence that says which law leaves the ranges of its numbers at an end of the range of the drive that
/// it follows.
std::string schedule_fault(const Plant& plant);

}  // namespace wheelhop
