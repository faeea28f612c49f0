/// \file
/// Where the gap between a plant and its records lies: in which channels, frequency bands, working ranges of the
/// elements and stretches of time.
///
/// Everything is counted in the misfit J = mean r^2, r = (yhat - y) over the noise floor, of which J - 1 is the gap.
/// The `excess` of a part is what it adds to J - 1: the excesses of all parts sum to it. The `share` is the excess over
/// the sum of all positive ones, so that shares are never negative and sum to 1; where no part is above the floor, all
/// are 0. Shares of a gap far below the noise are shares of chance.
#pragma once

#include <string>
#include <vector>

#include "core/data/records.hpp"
#include "core/greybox/trajectory.hpp"

namespace wheelhop {

/// A band of frequencies, over all channels and in each.
struct BandShare {
  double from_hz = 0, to_hz = 0;
  double share = 0, excess = 0;
  Vector channel_share;   ///< p; of the channel's own gap
  Vector channel_excess;  ///< p; the mean over channels is `excess`
};

/// A part of the range that a travel or a rate runs through.
struct RegionShare {
  std::string variable;  ///< "suspension.travel" [m] or "suspension.velocity" [m/s]
  double from = 0, to = 0;
  double share = 0, excess = 0;
  double time_share = 0;  ///< of the time; a gap that knows nothing of the variable has share = time_share
};

struct TimeShare {
  Index record = 0;
  double from_s = 0, to_s = 0;
  double share = 0, excess = 0;
};

struct GapProfile {
  double misfit = 0;
  Vector channel_misfit;         ///< p; their mean is `misfit`
  Vector nrmse, floor_nrmse;     ///< p; RMS of the error, and of the noise, over the RMS of the record
  std::vector<BandShare> bands;  ///< rising, without holes
  std::vector<RegionShare>
      regions;                  ///< variable after variable, each covered by bins of equal or (at its ends) less time
  std::vector<TimeShare> time;  ///< record after record
};

struct ProfileOptions {
  std::vector<double> band_edges_hz;  ///< rising, first 0, last half the sampling rate
  Matrix noise_shares;                ///< p x bands as `noise_shares`; empty: white
  Index slices = 10;                  ///< of time, a record
};

/// Edges [Hz] that keep the modes of a plant apart: half of the lowest and twice the highest undamped frequency,
/// between neighbours half and twice again where they are more than a factor of four apart, their geometric mean where
/// more than 1.5. For a quarter car: below the body's mode, the body's, between, the wheel's, above.
std::vector<double> band_edges(const Plant& plant, double nyquist_hz);

/// Which share of each channel's noise lies in each band, from the repeats of a set: p x bands, rows sum to 1. Empty if
/// there are none; the noise then counts as white.
Matrix noise_shares(const RecordSet& set, const std::vector<double>& band_edges_hz);

/// @param fit of fit_plant over `records` @param motion its trajectories
/// Bands by Welch's method (Hann, half overlapping segments, means kept), scaled so that they sum to J.
/// Cost O(N log N) a record and channel.
GapProfile profile(const PlantFit& fit, const std::vector<FitRecord>& records, const std::vector<Trajectory>& motion,
                   const ProfileOptions& options);

/// False for a gap of less than 0.3 noise levels, of whose place there is little to say.
bool has_gap(const GapProfile& profile);

/// The regions in which the gap lies most of all for the time spent there: share at least 1.5 x the time's, one in ten
/// of the gap at least; by share log(share / time_share), their part of the divergence between gap and time. Of one
/// variable at most two. None where there is no gap.
std::vector<RegionShare> standing_out(const GapProfile& profile, std::size_t count = 4);

}  // namespace wheelhop
