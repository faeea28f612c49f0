/// \file
/// Stable dynamic inversion (SDI) of the paper's Sec. 2.5, eqs. (18)-(21): a Kalman filter on the plant augmented by a
/// random-walk input, here with the direct term Dt and with a choice of read-outs.
#pragma once

#include <memory>

#include "core/base/options.hpp"
#include "core/identify/pieces.hpp"

namespace wheelhop {

struct SdiOptions {
  std::string read_out = "smoothed";
  Index lag = 5;
  double input_variance = 0;
  double input_pole = 1;
  template <class V>
  void fields(V&& visit) {
    visit("read_out", read_out, Choices{{"predictor", "filtered", "fixed_lag", "smoothed"}},
          "f(k|k-1) as in the paper, f(k|k), f(k|k+lag) or f(k|N)");
    visit("lag", lag, Range{0, 1000}, "samples", "look-ahead of the fixed-lag read-out");
    visit("input_variance", input_variance, Range{0, 1e12}, "-",
          "Q_eta over the mean of R_v; 0: the largest innovation likelihood on a logarithmic grid");
    visit("input_pole", input_pole, Range{0, 1}, "-",
          "pole of the input model; 1 is the random walk of eq. (18), less rescues a plant with a zero at z = 1");
  }
};

std::unique_ptr<InputReconstructor> make_sdi(const SdiOptions& options);

}  // namespace wheelhop
