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
/// Order statistics in which a failed value counts as minus infinity; quantiles interpolate linearly.
Statistics statistics_of(std::vector<double> values);

/// The p-quantile of values in ascending order, by linear interpolation between order statistics (Hyndman & Fan 1996,
/// type 7). Between an infinite and a finite one it is the nearer.
double quantile(const std::vector<double>& ascending, double p);

}  // namespace wheelhop
