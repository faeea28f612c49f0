/// \file
/// MOESP with past inputs as instrumental variables: step 1 of the paper's Sec. 2.7, eqs. (6)-(11).
#pragma once

#include <memory>

#include "core/identify/hankel_estimator.hpp"

namespace wheelhop {

using PiMoespOptions = HankelOptions;

std::unique_ptr<SubspaceEstimator> make_pi_moesp(const PiMoespOptions& options);

}  // namespace wheelhop
