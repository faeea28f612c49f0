/// \file
/// The plant with the gross faults of the instruments in it, from which a diagnosis goes on.
#pragma once

#include <optional>

#include "core/gap/evidence/closure.hpp"
#include "core/gap/verdict/thresholds.hpp"
#include "core/gap/which/hypothesis.hpp"

namespace wheelhop {

/// A plant and its two fits without any effect: what all else is compared with.
struct Base {
  Plant plant;
  Hypothesis delivered;  ///< its parameters as they are
  Hypothesis retuned;    ///< inside their tolerances
};

/// The base with gross faults in it, each the effect of the catalogue at its place; their sizes are parameters of the
/// plant with a tolerance then, as all others are. Sizes are fitted twice, so that the tolerance counts from a fit and
/// not from the coarse value of the fault.
/// @param base of a study   @param evidence out, what the faults remove
/// @return none without faults, where the catalogue does not offer one of them, or where they explain too little
/// (`faults_explain`). Cost: three fits of a plant inside its tolerances.
std::optional<Base> corrected(const Study& study, const Base& base, const std::vector<InstrumentFault>& faults,
                              double colour, const Bootstrap& bootstrap, const Thresholds& thresholds,
                              CorrectionEvidence& evidence);

}  // namespace wheelhop
