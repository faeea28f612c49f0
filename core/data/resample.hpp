/// \file
/// From one sampling rate to another: picking samples, and the drive between the samples of a record.
#pragma once

#include <string>
#include <vector>

#include "core/base/linalg.hpp"

namespace wheelhop {

/// Every `factor`-th sample, the first included: c x ceil(N / factor). No filter: the responses of a vehicle carry
/// 4e-11 of their power above half the measuring rate, and a filter would smear static laws over neighbouring samples.
/// Throws std::invalid_argument if factor < 1.
Matrix decimate(ConstMatrixRef samples, Index factor);

/// What a drive does between the samples of a record.
enum class Interpolation {
  band_limited,  ///< the one signal without content above half the sampling rate (windowed sinc)
  zoh,           ///< holds the last sample
  linear         ///< straight line to the next sample
};

/// Names as they stand in plant files: band_limited, zoh, linear.
const std::vector<std::string>& interpolation_names();
/// Throws std::invalid_argument for any other name.
Interpolation interpolation_from(const std::string& name);

/// Samples of a drive (c x N, at rate f) at the `factor` times higher rate: c x N factor, and column k factor is column
/// k of the input, bit for bit. The last factor - 1 columns lie behind the last sample: zoh and linear hold it,
/// band_limited extrapolates by reflection.
///
/// band_limited: sinc with a Kaiser window of 32 samples either side (beta 14.5), scaled so that constants are kept.
/// Largest error over the amplitude, measured on sines at 200 Hz -> 1000 Hz, 32 samples or more from the ends: 3e-8 at
/// 10 Hz, 2e-7 up to 85 Hz, 5e-3 at 90 Hz, 2e-1 at 95 Hz. At the ends the record is continued by odd reflection about
/// its end point, which keeps value and slope but not curvature: 10 Hz errs by 4e-3 between the first two samples, 5e-5
/// ten samples in, and 6e-2 behind the last sample; a straight line by nothing. Cost 64 multiplications a sample and
/// channel. Throws std::invalid_argument if factor < 1.
Matrix interpolate(ConstMatrixRef samples, Index factor, Interpolation kind);

/// The same between any two rates: samples of the drive at the instants k / to_hz that lie within the N / from_hz
/// seconds of the record. An integer ratio gives exactly the columns of the function above. Where to_hz < from_hz,
/// content above to_hz / 2 folds down, as it does in a converter that holds at to_hz. Throws std::invalid_argument if a
/// rate is not positive and finite.
Matrix interpolate(ConstMatrixRef samples, double from_hz, double to_hz, Interpolation kind);

/// A record at another rate: the samples at k / to_hz from the first one to the last. Upward by band_limited
/// interpolation; downward through a filter without delay, the same sinc and window stretched so that the lower rate
/// has 32 samples either side: what lies below 0.36 to_hz passes (1e-6), what lies above 0.5 to_hz does not (1e-6), so
/// that nothing folds. Inputs and outputs go through the same filter, which keeps a linear system between them as it
/// is. Ends as above. Throws std::invalid_argument if a rate is not positive and finite.
Matrix resample(ConstMatrixRef samples, double from_hz, double to_hz);

}  // namespace wheelhop
