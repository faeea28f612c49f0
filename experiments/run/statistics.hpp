/// \file
/// Order statistics of results over realisations.
#pragma once

#include <vector>

#include "core/base/linalg.hpp"

namespace wheelhop {

struct Statistics {
  double median, q05, q95, min;
  Index n_ok, n;
};
/// Order statistics in which a value that is not finite counts as minus infinity. @param values not empty
Statistics statistics_of(std::vector<double> values);

/// The p-quantile of values in ascending order, by linear interpolation between order statistics (Hyndman & Fan 1996,
/// type 7). Where one of the two order statistics is infinite it is the nearer one, the infinite one halfway, and
/// halfway between minus and plus infinity it is 0; so quantile(-values, 1 - p) = -quantile(values, p).
/// @param ascending not empty, no NaN
double quantile(const std::vector<double>& ascending, double p);

}  // namespace wheelhop
