/// \file
/// Where a gap enters, without any catalogue: at which place one unknown signal would explain what all channels leave.
#pragma once

#include <string>
#include <vector>

#include "core/base/status.hpp"
#include "core/gap/verdict/evidence.hpp"
#include "core/greybox/plant_fit.hpp"

namespace wheelhop {

/// For each place, eq. (17) with a known direction: per frequency the residual z of a fit is projected on the response
/// g of the linearised plant to a unit force there (the paper's trackability, Lemma 3), and what is left is compared
/// with the noise: leftover = min over d of sum |(I - g g^+) (z - J d)|^2 and the priors of the parameters, over (p -
/// 1) times the noise's, in the band that the drive excites; one of p channels' freedom went into the force. J d lets
/// the parameters and initial states of a linearised fit move anew at every place: they were fitted without an unknown
/// force, and bent to take its part. A sensor's unknown explains its own channel whole and no other. Places that the
/// linearised plant gives one direction at every frequency are merged.
///
/// The plant is linearised over the motion of the fit, so a gap many times the noise in a strongly nonlinear plant
/// leaves more than 1 even at the right place; the order of the places is what counts then.
/// @param fit of fit_plant over `records`
/// @param noise_shares p x bands of equal width up to half the sampling rate, as `noise_shares` gives them: coloured
/// noise counts as what it is in the band. Empty: white
/// @return ascending by leftover; empty for p = 1, where any place explains all. Cost: a transform a column of J and
/// record, a solution of the linear plant a place and line.
std::vector<PlaceLeftover> locate(const PlantFit& fit, const std::vector<FitRecord>& records,
                                  const Matrix& noise_shares = {});

/// The same for two places at once: z is projected on both responses, and what is left is compared with (p - 2) times
/// the noise. Of the eight best places every pair is tried.
/// @param places of `locate`, with the same noise   @return ascending by leftover; empty for p < 3, where any two
/// places explain all. Cost: as `locate`, and each pair as two places.
std::vector<PairLeftover> locate_two(const PlantFit& fit, const std::vector<FitRecord>& records,
                                     const std::vector<PlaceLeftover>& places, const Matrix& noise_shares = {});

/// True if an unknown signal that leaves so much explains all: the absolute test of a place, with an allowance for the
/// floor's own error and, in share of the gap, for what linearising leaves. @param misfit of the fit
bool explains_all(double leftover, double misfit);

/// Places where unknown signals would explain what a fit leaves.
struct Located {
  std::vector<PlaceLeftover> places;  ///< ascending by leftover
  std::vector<PairLeftover> pairs;    ///< where no single place explains all channels; else empty
  /// How many places it takes to explain all: 1, 2, or 0 where neither one unknown signal nor two do ("not locatable"),
  /// or too few channels tell. Of a pair that is the best place and an accelerometer upon it, or two of these, one
  /// place may be enough for a force that jumps: 1 as well.
  int needed = 0;
};
Located locate_needed(const PlantFit& fit, const std::vector<FitRecord>& records, const Matrix& noise_shares = {});

/// The unknown signal at a place, over a record.
struct UnknownSignal {
  Status status = Status::unavailable;
  std::string message;
  Place location;        ///< as asked for
  std::string unit;      ///< "N", of a sensor that of its channel
  Vector value;          ///< N, in time with the record; 0 in the leading samples that are not scored
  double rms = 0;        ///< over the scored samples
  double noise_rms = 0;  ///< what of that the noise alone makes, about
  double band_hz = 0;    ///< nothing above is reconstructed
};

/// What `locate` supposes at a place, as a signal: per frequency f = g^+ z, in the band that the drive excites, with
/// the sign of a law of the element: positive pulls its second node toward its first, so a missing damper reads c times
/// the rate and a guide's force is that of an element from the ground to its mass. Where f does not rise above what
/// noise would make of g^+ it is drawn towards zero (Wiener's weight from f's own spectrum, averaged over 9 lines). Of
/// a sensor it is measured minus simulated of its channel.
///
/// z fades in and out over its first and last twentieth, and so does f; silence is put around it. g is the response of
/// the plant linearised over the motion of the fit, exact for a force without content above the band; sensor paths
/// count as ideal. What the channels hardly see of a force (the static part of one between masses, to accelerometers)
/// is missing from f.
/// @param i number of the record   @param location of a PlaceLeftover, or one of its `same`
/// Status: unavailable if the plant has no such place; rank_deficient if no channel sees a force there. Cost: one
/// transform and a solution of the linear plant a frequency.
UnknownSignal unknown_signal(const PlantFit& fit, const std::vector<FitRecord>& records, std::size_t i,
                             const Place& location);

}  // namespace wheelhop
