/// \file
/// How far noise and what the model leaves out may have moved an identified model: standard deviations of its poles,
/// its frequency response and its free runs.
#pragma once

#include <complex>
#include <vector>

#include "core/identify/initial_state.hpp"
#include "core/model/nonlinear.hpp"

namespace wheelhop {

/// A linear model with the slope of the map at x = 0, u = 0 in it: A + Bt df/dx and so on. A model without a map as it
/// is.
LinearModel linearised_at_rest(const NonlinearModel& model);

/// A pole z = exp(lambda), lambda in rad/sample: frequency |lambda|, damping ratio -Re(lambda) / |lambda|.
struct UncertainPole {
  std::complex<double> pole;
  double frequency = 0, damping = 0;
  double frequency_std = 0, damping_std = 0;
};

/// Frequency responses at one frequency, p x m each.
struct UncertainResponse {
  double frequency = 0;  ///< rad/sample
  Eigen::MatrixXcd value;
  Matrix real_std, imaginary_std, magnitude_std;
};

struct ModelUncertainty {
  std::vector<UncertainPole> poles;  ///< n, of the model at rest
  std::vector<UncertainResponse> responses;
  Vector output_std;  ///< p, RMS over the records of the standard deviation of the free run
  Index blocks = 0;   ///< of residuals whose scatter was used
  bool known() const { return blocks > 0; }
};

/// With J the sensitivities of the free runs to all parameters theta and initial states, r the residuals of the fit
/// that minimises r' r, R their variances by output, H = J' J + the prior of the map (StaticMap::precision), and a
/// function c(theta) that does not depend on the coordinates of the states,
///   var c = max(dc H^+ J' R J H^+ dc',  sum over blocks b of (dc H^+ J_b' r_b)^2)  N / (N - P).
/// The first is the variance under white noise, the second (White 1980; blocks as in Kunsch 1989) that of residuals of
/// any colour, as a model leaves them that lacks something. Where noise is white, the two agree but for the scatter of
/// the second. Blocks: 40 over all records, of 20 samples at least. dc by central differences.
/// The records are the ones that were fitted; nothing is said of errors that all of them share, as of a wrong input
/// gain. A standard deviation is infinite where the records leave the function open, as between the lines of a
/// multisine. Nothing is known (blocks = 0) where a free run leaves the state guard, or with no more samples than
/// parameters.
/// @param frequencies rad/sample, of the responses
/// @param delay samples by which each input acts late, in the responses
///
/// Cost: a run with sensitivities and a plain one over all records, and for each of the P parameters two eigenvalue
/// problems and two linear systems a frequency.
ModelUncertainty model_uncertainty(const NonlinearModel& model, const std::vector<StartedRecord>& records,
                                   const std::vector<double>& frequencies, const std::vector<Index>& delay = {});

/// Forty frequencies, in rad/sample and equal ratios, from five periods in the record to nine tenths of half the
/// sampling rate. @param samples of the record
std::vector<double> response_frequencies(Index samples);

/// Normal quantile of a two-sided interval of 90 %.
inline constexpr double kNinetyPercent = 1.6448536269514722;

}  // namespace wheelhop
