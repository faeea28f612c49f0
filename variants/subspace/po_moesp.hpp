/// \file
/// MOESP with past inputs and past outputs as instrumental variables (Verhaegen 1994, "Identification of the
/// deterministic part of MIMO state space models given in innovations form from input-output data", Automatica 30).
/// Past outputs are valid instruments where what the linear model leaves over is noise. A nonlinearity in feedback is
/// none: its force depends on the past outputs, and the column space is bent towards it.
#pragma once

#include <memory>

#include "core/identify/hankel_estimator.hpp"

namespace wheelhop {

using PoMoespOptions = HankelOptions;

std::unique_ptr<SubspaceEstimator> make_po_moesp(const PoMoespOptions& options);

}  // namespace wheelhop
