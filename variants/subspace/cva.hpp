/// \file
/// Canonical variate analysis (Larimore 1990, "Canonical variate analysis in identification, filtering, and adaptive
/// control", CDC; as a weighting of subspace methods: Van Overschee & De Moor 1995). Future outputs and instruments are
/// both whitened once [1; U_future] is taken out of them, and the singular values are their canonical correlations:
///   W = (Y_f Y_f')^(-1/2) Y_f Z' (Z Z')^(-1/2),   Gamma = (Y_f Y_f')^(1/2) U S^(1/2).
/// Past outputs are among the instruments Z, with what po_moesp.hpp says of them.
#pragma once

#include <memory>

#include "core/identify/hankel_estimator.hpp"

namespace wheelhop {

struct CvaOptions {
  HankelOptions hankel = {};
  double rank_tolerance = 1e-8;
  template <class V>
  void fields(V&& visit) {
    hankel.fields(visit);
    visit("rank_tolerance", rank_tolerance, Range{0, 1}, "-",
          "directions of instruments and of future outputs below it times the largest are left out: whitening would "
          "raise their round-off to full size");
  }
};

std::unique_ptr<SubspaceEstimator> make_cva(const CvaOptions& options);

}  // namespace wheelhop
