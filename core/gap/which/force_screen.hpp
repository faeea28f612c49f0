/// \file
/// A screen in the domain of forces: what of the unknown force at a place the laws of candidates there make, along the
/// motion that the plant has under that force. The motion of a strongly nonlinear rig is far from that of its plant, of
/// which the screen by small changes (screen.hpp) knows alone; the force at the right place is not.
/// S. F. Masri, T. K. Caughey 1979, J. Appl. Mech. 46 (restoring force surface); the force itself is that of
/// `reconstruct_force`.
#pragma once

#include <vector>

#include "core/base/place.hpp"
#include "core/gap/which/hypothesis.hpp"
#include "core/gap/which/screen.hpp"

namespace wheelhop {

/// Candidates at one place, and what of the force there they make.
struct ForceScreened {
  std::vector<EffectCandidate> candidates;  ///< their plants at the sizes that were fitted to the force
  /// In descending order of `gain`, here the share of the force that the candidate's law explains beyond a constant and
  /// what the laws of the place do when they are re-tuned; `retuning` leads a fit of the whole plant from the solution
  /// of the study's re-tuned plant to what the force says.
  std::vector<Screened> screened;
};

/// What the best screens of a place are worth.
struct ForceScreenOptions {
  std::size_t fits = 6;  ///< candidates whose sizes are fitted to the force, the best by their typical size first
  double share = 0.5;    ///< of the force that a candidate explains at least, once its sizes are fitted
  std::size_t fits_of_plant = 3;  ///< of those, the best that are fitted to the records in pieces
};

/// The candidates at a place whose laws explain most of the unknown force there: by their typical size first; then with
/// their own sizes and those of the place's laws fitted to the element's whole force along that motion, as on a
/// dynamometer; the best of these then in the whole plant, to the records in pieces (multiple shooting), whose first
/// states that motion tells.
/// @param home a fit of the study's records, best of the plant as delivered, whose own laws what is missing has not
/// bent   @param retuned the fit from which candidates are fitted
/// @param location of an element or guide   @return nothing where no force can be reconstructed there
/// Cost: a reconstruction (`reconstruct_force`), a simulation of one element a candidate and record, some fits of one
/// element, and those of the plant.
ForceScreened screen_by_force(const Study& study, const PlantFit& home, const PlantFit& retuned, const Place& location,
                              const ForceScreenOptions& options);

}  // namespace wheelhop
