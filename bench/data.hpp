/// \file
/// Records of the bench: the linear quarter car at 200 Hz with one input and three outputs of unit size.
#pragma once

#include <cstdint>

#include "core/model/linear.hpp"

namespace wheelhop::bench {

struct CarRecord {
  LinearModel model;  ///< n = 4
  Matrix u, y;        ///< 1 x N, 3 x N
};

enum class Excitation {
  white,
  band_limited,  ///< the road of the paper's experiment
};

/// @param noise RMS of the noise over that of each output   @param draw which of the records with these properties
///
/// Made once for each combination and kept.
const CarRecord& car_record(Excitation drive, Index samples, double noise, std::uint64_t draw = 0);

/// Largest distance of an estimated pole from the true one that is nearest to it.
double pole_error(const Matrix& A, const Matrix& truth);

}  // namespace wheelhop::bench
