/// \file
/// What a diagnosis says on the terminal: the answer in one sentence, then tables.
#pragma once

#include <string>

#include "core/gap/diagnose.hpp"
#include "core/gap/study/examine.hpp"
#include "core/gap/study/placebo.hpp"

namespace wheelhop {

/// The sentence that a rig engineer reads first. @param follow_up of the verdict, or empty where only evidence is known
std::string answer(const Evidence& evidence, const Verdict& verdict, const FollowUp& follow_up);

/// The sentence, misfits of the stages and suspects, places, and parameters, on stdout.
/// @param placebo null where none was asked for
void print(const Diagnosis& diagnosis, const Placebo* placebo);
/// What re-tuning removes, beside the answer, a static map and any signal at one place; nothing where there is no gap.
void print_ceiling(const Diagnosis& diagnosis, const Ceiling& ceiling);
/// Where the gap lies and of what kind it is.
void print_examination(const Examination& examination);

}  // namespace wheelhop
