/// \file
/// Gross faults of instruments in a verdict: told before the answer where they were corrected, and as a hint where not.
#pragma once

#include <string>

#include "core/gap/verdict/thresholds.hpp"
#include "core/gap/verdict/verdict.hpp"

namespace wheelhop {

/// What faults that were not corrected read, and what to check. Empty without any.
std::string fault_message(const std::vector<InstrumentFault>& faults);

/// Whether a plant with gross faults in it is what the diagnosis goes on from: it removes `second` of the gap that
/// re-tuning leaves without them, or `turned` where one is a wrong sign, and more than chance does.
/// @param chi2_without of the plant re-tuned without the faults   @param chi2_with likewise, with them
bool faults_explain(double chi2_without, double chi2_with, double samples, double colour, bool turned,
                    const Thresholds& thresholds);

/// Puts the faults that were corrected before the answer of all other evidence. Without a name for what is left, or
/// with nothing left, the faults are the answer.
Verdict with_correction(const Evidence& evidence, const Thresholds& thresholds, Verdict verdict);

}  // namespace wheelhop
