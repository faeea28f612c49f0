/// \file
/// Stable non-causal inversion (Devasia, Chen & Paden 1996, "Nonlinear preview control, or stable inversion", IEEE
/// Trans. Automatic Control 41; in discrete time). The p outputs are squared down to q, v = W R^(-1/2) z; with r the
/// least number for which M = W C A^(r-1) Bt (r = 0: W Dt) is invertible, and zero for all lesser ones (a uniform
/// relative degree),
///   f_k = M^-1 (v_(k+r) - W C A^r x_k),   x_(k+1) = A x_k + Bt f_k.
/// The poles of that inverse are the zeros of the squared-down system. Those inside the unit circle run forward in
/// time, those outside backward, each from zero at its end of the record.
///
/// A zero near the circle forgets its unknown start slowly. Samples that have not forgotten all but the share
/// `forgotten` of it are outside [first, last); where none has, the status says how far from the circle the zero lies.
#pragma once

#include <memory>
#include <string>

#include "core/base/options.hpp"
#include "core/identify/pieces.hpp"

namespace wheelhop {

struct DevasiaOptions {
  std::string square_down = "combinations";
  Index channel = 0;
  Index combinations = 400;
  Index probe_samples = 4000;
  double forgotten = 0.01;
  Index seed = 1;
  template <class V>
  void fields(V&& visit) {
    visit("square_down", square_down, Choices{{"channel", "direct_term", "combinations"}},
          "one output (and the following ones for more unknown inputs), W = Dt' R^-1 (Bt' C' R^-1 without a direct "
          "term), or the best of random combinations by the output residual");
    visit("channel", channel, Range{0, 1000}, "-", "number of the (first) output that \"channel\" takes, from 0");
    visit("combinations", combinations, Range{1, 100000}, "-", "how many random ones are tried");
    visit("probe_samples", probe_samples, Range{10, 1e9}, "-", "of the record's start, by which they are compared");
    visit("forgotten", forgotten, Range{1e-12, 0.9}, "-",
          "share of an unknown start that may be left in a trustworthy sample");
    visit("seed", seed, Range{0, 1e15}, "-", "of the random combinations");
  }
};

std::unique_ptr<InputReconstructor> make_devasia(const DevasiaOptions& options);

}  // namespace wheelhop
