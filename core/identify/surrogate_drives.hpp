/// \file
/// Whether a model holds on other drives of the kind it was fitted to. A free run that is good on the records may
/// diverge on the next: the records then do not determine the model where that one goes.
#pragma once

#include <vector>

#include "core/model/nonlinear.hpp"

namespace wheelhop {

/// A drive made of a record's own, and the sample of the record whose state it starts from.
struct SurrogateDrive {
  Matrix u;  ///< m x N
  Index start = 0;
};

/// The drive backwards in time, and two made of pieces of it: an eighth of its length each, from places drawn with a
/// fixed seed, faded into one another over a quarter of a piece. All keep the range of the drive, have nearly its
/// spectrum, and jump nowhere that it does not; all inputs are moved together. Of a longer record the
/// 16384 samples of largest variance are read. @param u m x N, N >= 16: else there are none
std::vector<SurrogateDrive> surrogate_drives(ConstMatrixRef u);

/// The outputs of free runs over surrogate_drives(), p x N each; empty where one leaves the state guard.
/// @param u m x N   @param x0 n, of the record. Cost: four free runs
std::vector<Matrix> surrogate_outputs(const NonlinearModel& model, ConstVectorRef x0, ConstMatrixRef u);

/// By how much the free runs over surrogate_drives() leave the range of the measured outputs, the worst of the outputs,
/// in units of that range: 0 inside, infinity where a run leaves the state guard. @param y p x N
double excursion(const NonlinearModel& model, ConstVectorRef x0, ConstMatrixRef u, ConstMatrixRef y);

}  // namespace wheelhop
