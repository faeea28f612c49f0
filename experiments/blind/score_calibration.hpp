/// \file
/// What a rate over few cases is worth, and whether stated probabilities come true.
#pragma once

#include <utility>
#include <vector>

namespace wheelhop::scoring {

/// How many of n cases.
struct Rate {
  long hits = 0, n = 0;
  double value() const { return static_cast<double>(hits) / static_cast<double>(n); }  ///< NaN for n = 0
};

/// 95 % interval of the score test (Wilson 1927, without continuity correction): (p + z^2/2n +- z sqrt(p (1 - p)/n +
/// z^2/4n^2)) / (1 + z^2/n). [0, 1] for n = 0.
std::pair<double, double> wilson_interval(Rate rate);

/// A stated probability and whether it came true.
struct Forecast {
  double probability = 0;
  bool right = false;
};

/// Forecasts of about one size.
struct CalibrationBin {
  double from = 0, to = 0;  ///< least and greatest probability
  double confidence = 0;    ///< mean probability
  Rate right;
};

struct Calibration {
  std::vector<CalibrationBin> bins;
  double ece = 0;            ///< sum n_b / n |right_b - confidence_b| (Naeini, Cooper & Hauskrecht 2015)
  double ece_by_chance = 0;  ///< what a perfectly calibrated tool would show with as many cases (normal approximation)
  double brier = 0;          ///< mean (probability - right)^2
  double brier_skill = 0;    ///< 1 - brier / (r (1 - r)), r the share that is right; NaN where all or none are
};

/// Bins of equal mass: ten, or one for every ten forecasts where there are fewer than a hundred; equal probabilities
/// stay in one bin, so there may be fewer. NaN without forecasts.
Calibration calibrate(std::vector<Forecast> forecasts);

/// Median of the values (mean of the two middle ones), -infinity among them; NaN if there is none.
double median(std::vector<double> values);

}  // namespace wheelhop::scoring
