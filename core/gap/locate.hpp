/// \file
/// Where a gap enters, without any catalogue: at which place one unknown signal would explain what all channels leave.
#pragma once

#include <string>
#include <vector>

#include "core/gap/plant_fit.hpp"

namespace wheelhop {

/// A place at which something unknown may act on the plant or on a record.
struct Place {
  std::string location;           ///< element, "guide:MASS" (mass to ground) or "sensor:CHANNEL"
  std::vector<std::string> same;  ///< further locations that enter the same way: no record can tell them apart
  double leftover = 0;            ///< what an unknown signal there leaves, over the noise: 1 where it explains all
};

/// For each place, eq. (17) with a known direction: per frequency the residual z of a fit is projected on the response
/// g of the linearised plant to a unit force there (the paper's trackability, Lemma 3), and what is left is compared
/// with the noise: leftover = sum |(I - g g^+) z|^2 over (p - 1) times the noise's, in the band that the drive excites;
/// one of p channels' freedom went into the force. A sensor's unknown explains its own channel whole and no other.
/// Places that the linearised plant gives one direction are merged.
///
/// The plant is linearised at rest, so a gap many times the noise in a strongly nonlinear plant leaves more than 1 even
/// at the right place; the order of the places is what counts then.
/// @param fit of fit_plant over `records`   @return ascending by leftover; empty for p = 1, where any place explains
/// all Cost: one small projection a place, frequency and record.
std::vector<Place> locate(const PlantFit& fit, const std::vector<FitRecord>& records);

}  // namespace wheelhop
