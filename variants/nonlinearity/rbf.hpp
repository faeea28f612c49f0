/// \file
/// Radial basis functions: Gaussian units  phi_i = exp(-||P xi - c_i||^2 / (2 s_i^2))  (Broomhead & Lowe 1988) of a few
/// learned directions P. Directions start from those in which a polynomial fit bends (active_subspace), centres from
/// k-means of P xi (MacQueen 1967; started after Arthur & Vassilvitskii 2007), widths from the distance between
/// centres; variable projection then moves all of them. A force between two bodies needs one direction. Units of all
/// inputs alike (`directions` 0) need as many as fill the space: 40 of them leave a quarter of the variance of the
/// paper's spring.
#pragma once

#include "core/base/options.hpp"
#include "core/model/static_map.hpp"

namespace wheelhop {

struct RbfOptions {
  Index hidden_units = 6;
  Index directions = 1;
  double width_std = 1;
  template <class V>
  void fields(V&& visit) {
    visit("hidden_units", hidden_units, Range{1, 200}, "-", "Gaussian units");
    visit("directions", directions, Range{0, 20}, "-",
          "learned directions that the units see; 0: all inputs as they are, isotropic");
    visit(
        "width_std", width_std, Range{1e-3, 1e6}, "-",
        "standard deviation of the prior on the logarithm of a width in units of P xi, in the joint refinement alone: "
        "without one, spare units narrow around single noisy samples");
  }
};

std::unique_ptr<StaticMap> make_rbf(Index inputs, Index outputs, const RbfOptions& options);

}  // namespace wheelhop
