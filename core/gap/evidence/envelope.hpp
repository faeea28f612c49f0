/// \file
/// Inside and beyond what a fit has seen: an effect that closes the gap where it was fitted may open one further out.
#pragma once

#include <string>
#include <vector>

#include "core/gap/evidence/closure.hpp"
#include "core/greybox/trajectory.hpp"

namespace wheelhop {

/// The ranges in which travels and rates of a plant's elements moved, in the order of `trajectory_variables`.
struct MotionEnvelope {
  Vector low, high;
};

/// @param motion of the records a plant was fitted to   @param records leading samples that are not scored do not count
MotionEnvelope motion_envelope(const std::vector<Trajectory>& motion, const std::vector<FitRecord>& records);

/// 1 for every sample at which some element is outside its range, 0 elsewhere.
std::vector<char> outside_samples(const MotionEnvelope& envelope, const Trajectory& motion);

/// A variable that left its range, and by how much of that range's width at the most.
struct Excursion {
  std::string variable;
  double beyond = 0;
};

struct BeyondEnvelope {
  double time_share = 0;              ///< of the scored samples, that lie outside or ring on from there
  std::vector<Excursion> excursions;  ///< largest first
  Closure inside, outside;            ///< NaN where there is nothing, or no gap to close
  bool flagged = false;               ///< outside, closure may be negative, or is worse by more than 0.1 than inside
};

/// Closure inside and outside of what training has seen. What the sensors read rings on after an excursion; samples up
/// to one time constant of the plant's slowest oscillation behind it count as outside too.
/// @param before, after two plants' fits over the same held-out records   @param motion of one of them there
/// @param block samples   @param bootstrap of `closure`
BeyondEnvelope beyond_envelope(const PlantFit& before, const PlantFit& after, const std::vector<FitRecord>& records,
                               const MotionEnvelope& training, const std::vector<Trajectory>& motion, Index block,
                               const Bootstrap& bootstrap);

}  // namespace wheelhop
