/// \file
/// The records of a case: what the rig's measuring system hands over, and the noise-free ones kept with the key.
#pragma once

#include "core/data/records.hpp"
#include "experiments/rig/prepare.hpp"

namespace wheelhop::blind {

/// est_1, est_2 (the same motion, noise of their own) and val (another realisation of the drive).
RecordSet measured_records(const Prepared& prepared);

/// Noise-free: val_long, four times as long as a record, and beyond, at 1.25 times the drive.
RecordSet truth_records(const Prepared& prepared);

}  // namespace wheelhop::blind
