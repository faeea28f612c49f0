/// \file
/// A force put upon a plant: what `locate` and everything built on it suppose at a place.
#pragma once

#include <string>
#include <vector>

#include "core/base/place.hpp"
#include "core/greybox/plant_fit.hpp"
#include "core/plant/linearise.hpp"

namespace wheelhop {

/// True if a displacement input moves an end of the element.
bool drives(const PlantInput& input, const Element& element);

/// Where a force acts that stands for an unknown law.
struct ForcePlace {
  std::string from, to;
  std::string element = {};  ///< that has these ends, so that its force sensors read the law; empty for a guide
};

/// The force that a place stands for; false if it stands for none.
bool force_place_of(const Plant& plant, const Place& location, ForcePlace& place);

/// The plant with one more input, the last: a force, -u on `from` and +u on `to`. A drive's node stands still for a
/// force, as the ground does; no input is added where none of the two ends can move and no sensor reads the element.
Plant plant_with_force(const Plant& plant, ForcePlace place);

/// The plant of a fit with that input, linear over the motion that the records led it to, or about rest if that is not
/// known; empty matrices where no input was added, or it cannot be linearised.
LinearPlant linearise_with_force(const PlantFit& fit, const ForcePlace& place);

/// C (i w I - A)^-1 b + d of the last input, p. Not finite where a pole lies there.
ComplexVector force_response(const LinearPlant& linear, double frequency_hz);

/// Residual of a record in units of its noise, as measured minus simulated, p x N.
Matrix residual_of(const PlantFit& fit, const std::vector<FitRecord>& records, std::size_t i);

/// Upper end of the band [Hz] that holds nearly all of the drives' power, widened to what a nonlinear effect makes of
/// it.
double excited_band_hz(const Plant& plant, const FitRecord& record);

/// Samples at either end of a record over which an unknown signal fades: a twentieth.
Index fade_samples(Index samples);
/// One, but rising and falling as a half cosine over these.
Vector fade_window(Index samples);

}  // namespace wheelhop
