/// \file
/// The simulated records of one realisation of an experiment, and the truth that goes with them.
#pragma once

#include <string>

#include "experiments/experiment/config.hpp"

namespace wheelhop {

struct SimulatedRecords {
  Status status = Status::failed;  ///< of the simulations
  std::string message;
  Plant plant;                                ///< of this realisation
  Signal training, validation;                ///< as measured; the outputs that the config names
  Matrix clean;                               ///< validation outputs without noise, p x N
  Matrix training_states, validation_states;  ///< of the plant along the records
  Vector noise_std;                           ///< p; zero without noise
};

/// The records of a realisation. Random streams are keyed by seed, record and realisation alone, so that every method
/// sees the same data.
SimulatedRecords simulate_records(const ExperimentConfig& config, Index realisation);

/// Supplies the pipeline's initial guesses in a realisation.
Random initial_guess(const ExperimentConfig& config, Index realisation);

/// R^2 between the nonlinear parts of f and of the true force of the suspension along a record: of what regression on a
/// constant, the plant's states and its inputs leaves of each. NaN where the force has no nonlinear part.
/// @param plant as in SimulatedRecords   @param car where the suspension stands in it
/// @param u m x K   @param states 2n or more x K   @param f q x K
double spring_r2(const Plant& plant, const QuarterCar& car, ConstMatrixRef u, ConstMatrixRef states, ConstMatrixRef f);

}  // namespace wheelhop
