/// \file
/// Checks of an answer by other means than those that found it, and a test that would tell it from its nearest rival.
#pragma once

#include <string>
#include <vector>

#include "core/gap/plan/plan.hpp"
#include "core/gap/verdict/thresholds.hpp"
#include "core/gap/verdict/verdict.hpp"
#include "core/gap/which/hypothesis.hpp"

namespace wheelhop {

/// A check of the answer by other means than those that found it.
struct Check {
  std::string name;
  bool passed = false;
  std::string detail;
};

/// @param answer linearised, the hypothesis behind the verdict, which is one of effects
/// @param places_left places of the plant with the answer
std::vector<Check> checks_of(const Study& study, const Hypothesis& retuned, const Hypothesis& answer,
                             const Evidence& evidence, const Verdict& verdict,
                             const std::vector<PlaceLeftover>& places_left, const Thresholds& thresholds);

/// The test in which the effect named last and the first of those it could also be differ most; none without a rival.
SeparatingTest separating_test_of(const Study& study, const Verdict& verdict);

}  // namespace wheelhop
