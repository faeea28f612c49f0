/// \file
/// What a plant goes through under its drives: the ranges from which effects take a size to start at, so that a stop
/// starts where travel ends and a clearance as a share of travel, on a strut as on a bench of millimetres.
#pragma once

#include <vector>

#include "core/greybox/plant_fit.hpp"

namespace wheelhop {

struct ElementOperation {
  double travel_low_m = 0, travel_high_m = 0;
  double travel_rms_m = 0;  ///< about its mean
  double rate_rms_m_per_s = 0;
  double force_high_n = 0;  ///< the largest force that pulls the element's nodes together
  double force_rms_n = 0;   ///< about its mean
};

struct Operation {
  std::vector<ElementOperation> elements;
  /// Of each mass, what an element between the ground and it would go through: travel and rate are its position and
  /// velocity, and the force is the one that by itself would move it so, - m a.
  std::vector<ElementOperation> guides;
  Vector drive_peak;        ///< m, largest |u| [unit of the input]
  Vector drive_rate_peak;   ///< m, largest |u_k - u_{k-1}| over the hold time [unit/s]
  Vector output_rms;        ///< p, about the mean, as simulated
  Vector output_peak;       ///< p, largest |y|, as simulated
  Vector output_rate_peak;  ///< p, largest |y_k - y_{k-1}| over the sampling time [unit/s], as simulated
  Vector output_ceiling;  ///< p, largest |reading| that was measured, if many readings have just this size; 0: none do
  Vector output_quantum;  ///< p, step of the lattice that the measured values lie on; 0: none found
};

/// @param records measured outputs are read for `output_ceiling` alone
/// @param initial_states as of a fit of these records; none: from rest in equilibrium. False if a simulation fails.
/// Cost: one simulation of every record, and a sort of every channel.
bool operation_of(const Plant& plant, const std::vector<FitRecord>& records,
                  const std::vector<InitialState>& initial_states, Operation& operation);

}  // namespace wheelhop
