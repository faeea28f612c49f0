/// \file
/// Laws whose numbers follow a drive of kind "schedule": an adjustable damper with its voltage as a second input. In a
/// plant file
///   "inputs":   [..., {"name": "voltage", "kind": "schedule", "unit": "V", "range": [0, 5]}]
///   "elements": [{..., "laws": [{"law": "coulomb_friction", "force_n": 60, ...,
///                                "scheduled": {"by": "voltage", "slopes": {"force_n": 150}, "tolerance": 0.2}}]}]
/// the force of the friction is (60 N + 150 N/V u). The drive has a path like any other: the lag of a coil, a delay.
#pragma once

#include <string>

#include "core/plant/plant.hpp"

namespace wheelhop {

/// Of a drive, what laws see: a value beyond either end of the range counts as that end. What smooth curves through
/// steps overshoot does no harm then.
double within_range(Range range, double u);

/// The law with its numbers at a value of the drive that it follows, and without schedule.
Law law_at(const Law& law, double u);

/// The plant whose drives of kind "schedule" rest at the low or high ends of their ranges, without schedules; the
/// inputs stay. Where the plant is stiffest, as far as its numbers grow or fall with the drive, lies at one of both.
Plant at_end_of_schedules(const Plant& plant, bool high);

/// True if a law of the plant follows a drive.
bool has_schedules(const Plant& plant);

/// Empty, or which law leaves the ranges of its numbers at an end of the range of the drive that it follows, and how.
std::string leaves_range(const Plant& plant);

}  // namespace wheelhop
