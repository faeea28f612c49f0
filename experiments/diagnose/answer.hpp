/// \file
/// The answer of a diagnosis in words: the sentence that a rig engineer reads first.
#pragma once

#include <string>
#include <vector>

#include "core/gap/diagnose.hpp"

namespace wheelhop {

/// @param follow_up of the verdict, or empty where only evidence is known
std::string answer(const Evidence& evidence, const Verdict& verdict, const FollowUp& follow_up);

/// "A, B and C". @param last "and" or "or"
std::string listed(const std::vector<std::string>& items, const std::string& last);

}  // namespace wheelhop
