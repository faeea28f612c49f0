/// \file
/// From what a config asks for to a true system: parameters drawn inside their tolerances, forms drawn, sizes found at
/// which re-tuning inside the tolerances leaves the gap that was drawn.
#pragma once

#include "experiments/rig/cases.hpp"
#include "experiments/rig/system.hpp"

namespace wheelhop::blind {

/// Which realisation of a drive, exogenous force or noise a record has. Part of the result: never renumber.
enum class Realisation : std::uint64_t { estimation = 1, validation = 2, continuation = 3, beyond = 4 };

struct Prepared {
  CaseSpec spec;
  TrueSystem system;
  double noise_relative = 0;
  Vector noise_std;            ///< p
  double gap_sigma = 0;        ///< left by re-tuning, RMS over the noise's, pooled over channels; 0 for class parameter
  double delivered_sigma = 0;  ///< left by the plant as delivered
  double parameter_sigma = 0;  ///< class mixed: left by re-tuning all parameters but the wrong one
  std::string unreachable;     ///< why there is no such case; empty where there is one
};

std::vector<Command> commands_of(const CaseSpec& spec, Realisation realisation);

/// Cost: a run a parameter and about a dozen an effect, of the length of one record.
Prepared prepare(const CaseSpec& spec);

}  // namespace wheelhop::blind
