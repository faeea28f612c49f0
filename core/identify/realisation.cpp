#include "core/identify/realisation.hpp"

#include "core/model/linear.hpp"

namespace wheelhop {

OrderChoice order_from_gap(ConstVectorRef s, Index max_order) {
  OrderChoice choice;
  // Values at round-off carry no order, and a decomposition may return them as exact zeros: an infinite ratio.
  const double round_off = s.size() > 0 ? 1e-14 * s(0) : 0;
  for (Index n = 1; n <= std::min(max_order, s.size() - 1); ++n) {
    if (!(s(n - 1) > round_off)) break;
    const double gap = s(n - 1) / std::max(s(n), round_off);
    if (gap > choice.gap) choice = {n, gap};
  }
  return choice;
}

ObservabilityPair shift_invariance(ConstMatrixRef gamma, Index p) {
  const Index rows = gamma.rows() - p;
  ObservabilityPair pair;
  const Matrix A = least_squares(gamma.topRows(rows), gamma.bottomRows(rows)).x;
  pair.A = stabilised(A);
  pair.stabilised = pair.A != A;
  pair.C = gamma.topRows(p);
  return pair;
}

}  // namespace wheelhop
