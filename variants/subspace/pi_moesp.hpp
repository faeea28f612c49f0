/// \file
/// MOESP with past inputs as instrumental variables: step 1 of the paper's Sec. 2.7, eqs. (6)-(11).
#pragma once

#include <memory>

#include "core/base/options.hpp"
#include "core/identify/pieces.hpp"

namespace wheelhop {

struct PiMoespOptions {
  Index block_rows = 30;
  Index past_block_rows = 0;
  Index max_order = 10;
  template <class V>
  void fields(V&& visit) {
    visit("block_rows", block_rows, Range{2, 400}, "-",
          "s of eq. (6); must span the slowest mode: fewer than 20 at 200 Hz hide a 1.5 Hz body mode");
    visit("past_block_rows", past_block_rows, Range{0, 400}, "-", "block rows of the instruments; 0: as block_rows");
    visit("max_order", max_order, Range{1, 100}, "-", "largest order tried when it is read from the singular values");
  }
};

std::unique_ptr<SubspaceEstimator> make_pi_moesp(const PiMoespOptions& options);

}  // namespace wheelhop
