/// \file
/// What kind of gap it is, before any cause is named: does it repeat, does it drift, is it linear, odd or even.
#pragma once

#include <string>

#include "core/gap/evidence/noise_floor.hpp"
#include "core/greybox/plant_fit.hpp"

namespace wheelhop {

/// The squared error of a single record falls into what comes again with the drive and what does not.
struct Repeatability {
  bool known = false;  ///< false without repeats: the floor is then given or estimated, not seen
  double share = 0;    ///< that repeats, over all channels in units of the floor
  Vector channel;      ///< p
};

/// From the error of the mean of R repeats: mean e^2 - s^2 / R repeats, s^2 (the variance between repeats) does not.
/// @param fit of fit_plant over `records`, whose weight_std is s / sqrt(R)
Repeatability repeatability(const PlantFit& fit, const std::vector<FitRecord>& records, const NoiseFloor& floor);

/// The error of the last third against that of the first.
struct Drift {
  bool known = false;          ///< false where a third of the records holds fewer than three blocks
  bool significant = false;    ///< p below 0.01
  double p = 1;                ///< that chance alone does this, after the number of comparisons
  std::string kind;            ///< what differs most: "size", "offset", "gain" or "phase"
  std::string channel;         ///< of the latter three
  double first = 0, last = 0;  ///< misfit in the two thirds; gain and offset in RMS values of the channel; phase in s
};

/// In blocks of time the error is put down to an offset, to the simulated output and to its derivative (a gain, a delay
/// that the plant lacks) by least squares; those coefficients and the misfit of the first third's blocks are compared
/// with the last third's (Welch's t test, times the number of comparisons). A plant that was tuned to the whole record
/// errs in both thirds alike in size but with opposite gain, which size alone would not show.
/// @param block samples of a block, long enough for independent blocks (2 s)
Drift drift(const PlantFit& fit, const std::vector<FitRecord>& records, Index block);

/// Where the drive is periodic: on which lines the error stands.
struct LineSplit {
  bool known = false;
  std::string why_not;  ///< where it is not known
  double period_s = 0;
  Index periods = 0;      ///< averaged over, of the longest record
  bool odd_apart = true;  ///< false: every odd line is excited, and `linear` holds the odd distortions too
  double linear = 0, odd = 0, even = 0;  ///< sum to 1; all 0 where no line is above the noise
};

/// Splits the error by the lines of a periodic drive (odd random-phase multisines are made for that: Pintelon,
/// Schoukens 2012, ch. 4): on unexcited even lines stands what even laws make, on unexcited odd ones what odd laws
/// make, and what these put on excited lines is read off the unexcited neighbours of the same parity. The rest on
/// excited lines is what a linear correction could mend for this drive, the average gain of an odd law included. The
/// mean is left out: a sensor's bias and an even law look the same there.
///
/// The period is that of the drive's autocorrelation; without one a whole record counts as a period if a fifth of the
/// lines between its lowest and highest is empty. The noise is that between periods, with one period that of the floor.
/// The first of three or more periods is left to the transients.
LineSplit line_split(const PlantFit& fit, const std::vector<FitRecord>& records);

/// Period of a drive in samples, 0 if none repeats at least twice. @param u m x N
Index find_period(ConstMatrixRef u);

}  // namespace wheelhop
