/// \file
/// One search for what a plant lacks: from a plant and its two fits without any effect to evidence and a verdict.
#pragma once

#include <memory>
#include <optional>

#include "core/gap/diagnose.hpp"
#include "core/gap/which/correction.hpp"

namespace wheelhop {

/// What every search of a diagnosis reads; kept by reference.
struct Setting {
  const GapData& data;
  const GapSolvers& solvers;
  const CandidateList& candidates;
  const DiagnoseOptions& options;
  const NoiseFloor& floor;
  const Bootstrap& bootstrap;
  const Step& step;
};

/// What one search found. `search` refers to the members before it, so that it stays where it is.
struct Investigation {
  Base base;
  CandidateList candidates;  ///< without those whose parameters the plant has already
  std::optional<Study> study;
  std::optional<Search> search;
  Evidence evidence;
  Verdict verdict;
  Candidates singles;
  EffectSets sets;
  Candidates beside;  ///< the answer with parameters set free
  FreedParameters freed;
  Hypothesis* answer = nullptr;  ///< the plant of the verdict; null where it is none
};

/// Why a plant cannot be compared with the records; empty if it can.
std::string cannot_follow(const Plant& plant, const GapData& data, const Hypothesis& delivered,
                          const Hypothesis& retuned);

/// Where the gap lies, which effects, parameters and sets of effects explain it how well, and the verdict. More is
/// fitted where the answer explains little: effects that the screen expects less of, and finer forms.
/// @param delivered the plant as it came, on the held-out records   @param faults gross ones that are not corrected
/// @param correction those that are, in the base
std::unique_ptr<Investigation> investigate(const Setting& setting, Base base, const GapStage& delivered,
                                           std::vector<InstrumentFault> faults, CorrectionEvidence correction);

/// Dispersion that the fits of a search should have expected: that of the best fit it found, where the answer explains
/// little, the best fit leaves more than noise, and parameters left their tolerances; 1 otherwise.
double dispersion_needed(const Investigation& found, const Setting& setting);

}  // namespace wheelhop
