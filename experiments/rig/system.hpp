/// \file
/// The whole true system: command, drive path, rig with its effects, sensor paths, record.
#pragma once

#include "experiments/rig/effects.hpp"

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

/// The commands of one record, and their samples at the hold rate, which every run without a drive path shares.
struct Playback {
  std::vector<Command> commands;  ///< one an input
  Matrix held;                    ///< m x (lead + record)
};
Playback play(const Plan& plan, std::vector<Command> commands, const ObserveOptions& options);

/// @param playback made with the same lead and samples. RigFailure as `run_rig`.
Observation observe(const TrueSystem& system, const Playback& playback, const ObserveOptions& options);

/// Rounds to the converter steps of the effects.
void convert(const TrueSystem& system, Matrix& y);

}  // namespace wheelhop::blind
