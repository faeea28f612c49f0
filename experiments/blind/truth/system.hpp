/// \file
/// The whole true system: command, drive path, rig with its effects, sensor paths, record.
#pragma once

#include "experiments/blind/truth/effects.hpp"

namespace wheelhop::blind {

inline constexpr double record_hz = 200;  ///< rate of all records; divides every plant's hold rate

struct TrueSystem {
  const Plan* plan = nullptr;
  Vector theta;  ///< before the factors of the effects
  std::vector<TrueEffect> effects;
};

struct ObserveOptions {
  Index samples = 8000;    ///< of the record
  double lead_s = 5;       ///< of the same drive before the record: the rig has settled
  double epoch_s = 0;      ///< see RunOptions
  double accuracy = 1e-8;  ///< see RunOptions
};

struct Observation {
  Matrix command;  ///< m x samples
  Matrix clean;    ///< p x samples, without noise and before converters round
  std::vector<Extent> elements, masses;
};

/// @param commands one an input. RigFailure as `run_rig`.
Observation observe(const TrueSystem& system, const std::vector<Command>& commands, const ObserveOptions& options);

/// Rounds to the converter steps of the effects.
void convert(const TrueSystem& system, Matrix& y);

}  // namespace wheelhop::blind
