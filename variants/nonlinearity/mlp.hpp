/// \file
/// Multilayer perceptron with one hidden layer of tanh units: phi_i = tanh(w_i' xi + c_i).
#pragma once

#include "core/base/options.hpp"
#include "core/model/static_map.hpp"

namespace wheelhop {

inline constexpr Index kMostUnits = 100;

struct MlpOptions {
  Index hidden_units = 5;
  double slope_std = 3;
  template <class V>
  void fields(V&& visit) {
    visit("hidden_units", hidden_units, Range{1, kMostUnits}, "-",
          "tanh units; 3 to 6 suffice for one spring, more cost time and extrapolate worse");
    visit("slope_std", slope_std, Range{1e-3, 1e6}, "-",
          "standard deviation of the prior on w: without one, spare units become steps around single noisy samples");
  }
};

std::unique_ptr<StaticMap> make_mlp(Index inputs, Index outputs, const MlpOptions& options);

}  // namespace wheelhop
