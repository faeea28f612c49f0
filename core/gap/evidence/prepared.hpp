/// \file
/// The records of a diagnosis, made ready for thousands of simulations.
#pragma once

#include <vector>

#include "core/gap/evidence/noise_floor.hpp"
#include "core/gap/verdict/evidence.hpp"
#include "core/greybox/plant_fit.hpp"

namespace wheelhop {

/// The records of a set, made ready: repeats merged, outputs to be divided by the noise floor of their mean.
struct GapData {
  std::vector<FitRecord> fitted;    ///< of the role "estimation"
  std::vector<FitRecord> held_out;  ///< of the role "validation": effects are compared and scored on these as well
  bool apart = true;                ///< false: there is no validation record, and the fitted ones stand for it
  Index block = 1;                  ///< samples of a block of the bootstrap
  Matrix noise_shares;              ///< p x bands of equal width, as `noise_shares`; empty: the noise counts as white
  double samples = 0;  ///< p N summed over all records, skipped samples left out: chi2 of a plant at the floor
};

/// Samples of a block of `block_s`, or of a quarter of the longest record where that is less.
Index block_samples(const RecordSet& set, double block_s);

/// UserError if a record has fewer than three readings for each parameter and initial state, or none has the role
/// "estimation", or in these no drive moves and no reading decays.
GapData gap_data(const Plant& plant, const RecordSet& set, const NoiseFloor& floor, double block_s);

/// Leaves out the end of every record, where the clock of its drive, 1 + skew times as fast as its own, has run past
/// what was measured or depends on what comes behind it (`kUnsureEnds`). At least four blocks stay. Nothing to do for
/// skew <= 0.
void leave_out_end(std::vector<FitRecord>& records, Index block, double skew);
void leave_out_end(GapData& data, double skew);

/// Dispersion of what a fit leaves of all records: 1 + (misfit - 1) colour, the colour that of its residuals. Residuals
/// in one band tell parameters by as much less than white ones, as their density there is larger than its mean.
double dispersion_of(const GapData& data, const PlantFit& fitted, const PlantFit& held_out);
/// Every fit of these records expects residuals so large. @param dispersion >= 1
void disperse(GapData& data, double dispersion);

/// What a plant leaves of the held-out records, from `judged_from` on. @param run of fit_plant over them
GapStage stage_of(const GapData& data, const PlantFit& run);

}  // namespace wheelhop
