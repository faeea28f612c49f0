/// \file
/// The motion of a plant's elements and masses under its records: travel and rate, which say where in its working range
/// a plant is.
#pragma once

#include <string>
#include <vector>

#include "core/greybox/plant_fit.hpp"

namespace wheelhop {

/// One row an element of the plant, one column a sample of the record.
struct Trajectory {
  Matrix travel;              ///< E x N, x_to - x_from [m]
  Matrix rate;                ///< E x N, its derivative [m/s]; a held drive moves as `simulate` says
  Matrix position, velocity;  ///< n x N of the masses [m], [m/s], against the ground
  /// Travels over rates, 2E x N, in the order of `trajectory_variables`.
  Matrix stacked() const;
};

/// "suspension.travel" of every element, then "suspension.velocity" of every element.
std::vector<std::string> trajectory_variables(const Plant& plant);

/// Simulated motion of a fitted plant over each of its records, from the fitted initial states, drive paths included.
/// Cost: one simulation a record.
std::vector<Trajectory> trajectories(const PlantFit& fit, const std::vector<FitRecord>& records);

}  // namespace wheelhop
