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

/// A channel of the other sign: of the drives and sensors of which the catalogue offers a gain, the one whose reversal
/// leaves least with the plant re-tuned inside its tolerances, if the records tell its sign and it explains enough
/// (`faults_explain`). A plant bent by it makes nothing of the drive that a correlation would show. Cost: a fit of the
/// plant inside its tolerances for each channel.
/// @return one gain error, of the size that was fitted, or none
std::vector<InstrumentFault> wrong_sign(const Study& study, const Base& base, double colour,
                                        const Thresholds& thresholds);

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
