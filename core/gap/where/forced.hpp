/// \file
/// A plant under further forces at one place, in free run: what they leave of its residuals.
#pragma once

#include <string>
#include <vector>

#include "core/base/place.hpp"
#include "core/greybox/plant_fit.hpp"

namespace wheelhop {

/// Times that a reconstruction is repeated at most ...
inline constexpr int kReconstructions = 6;
/// ... and what of a misfit it may leave for another one to pay.
inline constexpr double kWorthwhile = 0.98;

/// A plant on which a force acts at a place. Its last element, of no stiffness, moves as the place does.
struct ForcedPlant {
  PlantFit fit;                    ///< plant and initial states alone
  std::vector<FitRecord> records;  ///< the last drive is the force
};

/// @param fit of `records`   @param location as unknown_signal, a place of the plant   @param forces one a record, N
/// [N], signs as there
ForcedPlant force_at(const PlantFit& fit, const std::vector<FitRecord>& records, const Place& location,
                     const std::vector<Vector>& forces);

/// (yhat - y) over the noise, p x K a record, K the scored samples; empty where the plant does not follow.
std::vector<Matrix> residuals(const ForcedPlant& forced);

/// Travel [m] and rate [m/s] of the place, 2 x N a record.
std::vector<Matrix> motion_at_place(const ForcedPlant& forced);

/// Residuals that fade at their ends as an unknown signal does.
Matrix faded(const Matrix& residual);
/// Mean square of residuals over the samples in which nothing fades; NaN if there are none.
double inner_misfit(const std::vector<Matrix>& residuals);

/// The forces at a place that explain the residuals of a plant best.
struct ForceReconstruction {
  std::string why_not;         ///< empty where it was possible
  std::vector<Vector> forces;  ///< one a record, N
  ForcedPlant forced;
  std::vector<Matrix> left;  ///< residuals under them
};

/// unknown_signal, and again of what it leaves as long as that pays: its linear plant does not know how stiff the
/// moving one is. @param fit, records, location as force_at
ForceReconstruction reconstruct_force(const PlantFit& fit, const std::vector<FitRecord>& records,
                                      const Place& location);

}  // namespace wheelhop
