/// \file
/// What an error of a plant's parameter is called, and where it stands.
#pragma once

#include <string>

#include "core/plant/plant.hpp"

namespace wheelhop {

struct ParameterLabel {
  EffectId effect;  ///< "mass_error" or "spring_nonlinearity", say
  Place location;
};

/// By what a change of the parameter changes at rest, or by how it bends a law away from there.
/// @param parameter full name, as of plant_parameters   UserError if the plant has no such parameter.
ParameterLabel label_of(const Plant& plant, const std::string& parameter);

}  // namespace wheelhop
