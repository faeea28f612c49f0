/// \file
/// The config of a set of blind cases, and the cases it asks for.
#pragma once

#include <memory>

#include "experiments/rig/effects.hpp"

namespace wheelhop::blind {

/// An effect that a case shall have, before its form is drawn.
struct Wanted {
  const EffectKind* kind = nullptr;
  std::string place;
};

/// One case as the config asks for it. Everything random about it follows from (seed, number).
struct CaseSpec {
  std::uint64_t seed = 1, number = 0;
  std::string set, case_class;  ///< class: single, none, parameter, unknown, double
  std::shared_ptr<const Plan> plan;
  std::vector<Wanted> effects;
  std::string strength_class;  ///< weak, medium, strong; empty for class none
  DriveShape drive;
  bool coloured = false, truth = true;
  double noise_low = 0.01, noise_high = 0.02;
  Index samples = 8000;
};

/// Config: {"seed"?: 1, "truth"?: true, "sets": [SET, ...]}, SET:
/// {"name": any, "plant": NAME of a file plants/NAME.json beside the config, or a plant file's object,
///  "class": "single" | "none" | "parameter" | "unknown" | "double",
///  "effects"?: "all" or a list of "ID", "ID@PLACE" or a form's text,
///  "strengths"?: ["weak", "medium", "strong"], "seeds"?: 1 (cases of each effect and strength; of class none and
///  double: how many cases), "drives"?: ["multisine"], "level"?: 0.008 (RMS of the drive), "band_hz"?: [0.3, 25],
///  "noise"?: ["white"] (white, coloured), "noise_relative"?: [0.01, 0.02], "samples"?: 8000}.
/// Drives and noises take turns in drawn orders; where a place is not named it is drawn; pairs of effects stand at one
/// place and at two by turns. UserError on every mistake.
/// @param seed replaces that of the config where it is given
std::vector<CaseSpec> read_cases(const JsonCursor& config, std::optional<std::uint64_t> seed);

}  // namespace wheelhop::blind
