/// \file
/// Laws at one place against a force that is known there, as on a dynamometer: which of a catalogue make it along a
/// known motion, and at which sizes.
#pragma once

#include <utility>
#include <vector>

#include "core/base/place.hpp"
#include "core/gap/which/hypothesis.hpp"
#include "core/gap/which/screen.hpp"

namespace wheelhop {

/// The element at a location; null if there is none yet.
const Element* element_at(const Plant& plant, const Place& location);

/// What is known of the force at a place: the motion there and, of the samples that count, the element's whole force
/// about its mean.
struct ForceThere {
  std::vector<Matrix> motion;                    ///< travel [m] over rate [m/s], 2 x N a record
  std::vector<std::pair<Index, Index>> samples;  ///< first and number of those that count, a record
  double sampling_hz = 0;
  Vector force;  ///< [N], of all records one after the other

  /// The samples that count of all records, about their mean. @param of_record values of record number i, N
  template <class OfRecord>
  Vector stacked(const OfRecord& of_record) const {
    Index rows = 0;
    for (const auto& [first, count] : samples) rows += count;
    Vector all(rows);
    Index filled = 0;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      all.segment(filled, samples[i].second) = of_record(i).segment(samples[i].first, samples[i].second);
      filled += samples[i].second;
    }
    return all.array() - all.mean();
  }
  /// Force of an element along the motion, stacked. False outside its domain.
  bool along(const Element& element, Vector& along_it) const;
};

/// The ranges of travel and rate of a motion, and the forces of an element in proportion to its travel.
/// @param motion as in ForceThere   @param operation in: of the plant without the force; out: along the motion
void size_by_motion(const std::vector<Matrix>& motion, ElementOperation& operation);

/// The candidates at a place, and what of the force there they make.
struct ForceScreened {
  std::vector<EffectCandidate> candidates;  ///< their plants at the sizes that were fitted to the force
  /// In descending order of `gain`, here the share of the unknown force that the candidate's law explains beyond a
  /// constant and what the laws of the place do when they are re-tuned. `retuning`: as of the function that returns it.
  std::vector<Screened> screened;
};

/// What the best screens of a place are worth.
struct ForceScreenOptions {
  std::size_t fits = 6;  ///< candidates whose sizes are fitted to the force, the best by their typical size first
  double share = 0.5;    ///< of the force that a candidate explains at least, once its sizes are fitted
  std::size_t fits_of_plant = 3;  ///< of those, the best that are kept
};

/// The candidates whose laws make most of what is unknown of a force: by their typical size first; then with their own
/// sizes and those of the place's laws fitted to the whole force along the motion.
/// @param base plant with the laws that are known at the place
/// @param candidates of that place, each with a law there and its tolerances at their values in `base`
/// @param elsewhere tolerances of the parameters of other places, in theta of all of the study's
/// @return those that make more than a share of it. `retuning` is theta of the study's tolerances, counted from the
/// plant as delivered. Empty where there is no unknown force, or the laws of the place do not follow the motion Cost: a
/// simulation of one element a candidate and record, and some fits of one element. Runs side by side.
ForceScreened screen_by_known_force(const Study& study, const Plant& base, const ForceThere& there,
                                    const Place& location, std::vector<EffectCandidate> candidates,
                                    ConstVectorRef elsewhere, const ForceScreenOptions& options);

}  // namespace wheelhop
