/// \file
/// Row 3f of the decision table: a wrong parameter beside the effects of an answer.
#pragma once

#include "core/gap/verdict/thresholds.hpp"
#include "core/gap/verdict/verdict.hpp"

namespace wheelhop {

/// Names a parameter that is wrong beside the effects (P > `stands_out`). Where with it free another one leaves its
/// tolerance that no form of the effects bends, or one of another name would have to be named as well, none is named.
/// @param verdict one of effects; gets the parameter's name, suspect and place, and `parameter` of its answer
void add_parameter_beside(const Evidence& evidence, const Thresholds& thresholds, Verdict& verdict);

}  // namespace wheelhop
