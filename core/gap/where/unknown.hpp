/// \file
/// What can be said of a signal that no effect of the catalogue explains: whether it is the plant's own doing at all.
#pragma once

#include <vector>

#include "core/gap/verdict/evidence.hpp"
#include "core/greybox/plant_fit.hpp"

namespace wheelhop {

/// Share of the unknown signal at a place (above its noise) that travel and rate of the plant's elements and masses,
/// and the drive, explain: the largest of three. For smooth laws that stay the same, by least squares on polynomials up
/// to the third degree, |.|, and their short memories, of one place or all, fitted on either half of each record and
/// measured on the other. For stops, limits and contacts that open, in the same way on what travel and rate of one
/// place exceed 1.5, 2 and 2.5 of their RMS by. For laws that change with time, by travel and rate of one place in
/// windows of 0.125 to 2 s, beyond what the same motion of other times explains. A law of any form that the plant may
/// lack reads these; a force from outside does not: what they explain of it is no more than what they explain of
/// surrogates, the same signal moved around in time by sixteenths of a record. 0 ... 1, exactly 0 where it is less than
/// 0.04 and no more than that (twice the most of the surrogates, or 0.005); NaN where the signal cannot be
/// reconstructed.
/// @param fit of fit_plant over `records`   @param location as in locate
/// @param entry a place among those that enter in the same way, to ask how far what it alone reads explains the
/// signal; empty: everything that moves
double explained_by_states(const PlantFit& fit, const std::vector<FitRecord>& records, const Place& location,
                           const Place& entry = {});

/// What the motion of everything that may be at work explains of the unknown signals at the best places: for the best
/// place all that moves; for every place near to it each place that enters alike; and, where the best place is a
/// guided mass, the elements that hang on it.
/// @param fit of fit_plant over `records`   @param places ascending by leftover
/// @param near leftover over that of the best place, up to which a place is asked
std::vector<MotionShare> motion_shares(const PlantFit& fit, const std::vector<FitRecord>& records,
                                       const std::vector<PlaceLeftover>& places, double near);

}  // namespace wheelhop
