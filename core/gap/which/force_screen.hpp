/// \file
/// A screen in the domain of forces: what of the unknown force at a place the laws of candidates there make, along the
/// motion that the plant has under that force. The motion of a strongly nonlinear rig is far from that of its plant, of
/// which the screen by small changes (screen.hpp) knows alone; the force at the right place is not.
/// S. F. Masri, T. K. Caughey 1979, J. Appl. Mech. 46 (restoring force surface); the force itself is that of
/// `reconstruct_force`.
#pragma once

#include <functional>

#include "core/base/place.hpp"
#include "core/gap/which/element_fit.hpp"

namespace wheelhop {

/// The candidates at a place whose laws explain most of the unknown force there, as `screen_by_known_force`; the best
/// of these then in the whole plant, to the records in pieces (multiple shooting), whose first states that motion
/// tells.
/// @param home a fit of the study's records, best of the plant as delivered, whose own laws what is missing has not
/// bent   @param retuned the fit from which candidates are fitted
/// @param location of an element or guide   @return nothing where no force can be reconstructed there
/// Cost: a reconstruction (`reconstruct_force`), `screen_by_known_force`, and the fits of the plant.
ForceScreened screen_by_force(const Study& study, const PlantFit& home, const PlantFit& retuned, const Place& location,
                              const ForceScreenOptions& options);

/// Other laws that make nearly the force that an answer's element makes, along the motion of the answer. Where the
/// answer leaves little, that motion is the rig's, and a law that makes the same force leaves as little. The screen by
/// small changes may have dropped it, around a plant that re-tuning has bent.
/// @param answer a fit with effects at the place   @param retuned as above   @param asked whether a candidate may be
/// one   @return nothing where no law stands at the place, or the answer has masses that the plant lacks
/// Cost: a simulation of the records, and `screen_by_known_force`.
ForceScreened screen_rivals(const Study& study, const PlantFit& answer, const PlantFit& retuned, const Place& location,
                            const std::function<bool(const EffectCandidate&)>& asked,
                            const ForceScreenOptions& options);

}  // namespace wheelhop
