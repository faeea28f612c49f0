/// \file
/// A linear model of a record of which nothing is known but its channels: input delays, time scales and order are
/// found, the first two by least squares, the order by free runs on a part of the record that was held out.
#pragma once

#include <vector>

#include "core/base/options.hpp"
#include "core/identify/pieces.hpp"
#include "core/optimise/solver.hpp"

namespace wheelhop {

struct LinearSearchOptions {
  Index max_order = 20;
  Index max_delay = 20;
  Index block_rows = 20;
  Index iterations = 20;
  template <class V>
  void fields(V&& visit) {
    visit("max_order", max_order, Range{1, 100}, "-", "largest order tried");
    visit("max_delay", max_delay, Range{0, 1000}, "samples", "largest delay of an input that is looked for; 0: none");
    visit("block_rows", block_rows, Range{3, 400}, "-",
          "of the block-Hankel matrices, at every block length that the record is averaged to");
    visit("iterations", iterations, Range{1, 10000}, "-", "cap on the refinement by simulation error, at every order");
  }
};

/// One order that was tried.
struct OrderTrial {
  Index stride = 0;         ///< block length that the poles were found at, samples
  Vector held_out_error;    ///< p, RMS of the free run's error on the held-out part, in the units of y
  LinearEstimate estimate;  ///< of the fitted part, states of unit covariance

  Index order() const { return estimate.order_used; }
};

struct LinearSearch {
  /// Of the inputs as they act: row i late by delay(i), from sample max(delay) on. States of unit covariance, x0 at
  /// that sample.
  LinearEstimate estimate;
  std::vector<Index> delay;        ///< m, samples
  std::vector<OrderTrial> orders;  ///< ascending
};

/// Inputs as they act: column k of row i is u_i at sample k + last - delay_i, last the largest delay; N - last columns.
Matrix delayed(ConstMatrixRef u, const std::vector<Index>& delay);
Index longest(const std::vector<Index>& delay);

/// Steps:
/// 1. A and C of every order by pole_sets(), B, D, x0 and y0 by least squares on the simulated outputs.
/// 2. Of the sets of an order the one with the least error, refined by simulation error on the fitted part.
/// 3. The smallest order whose held-out error is in no output more than `order_margin` (judgements.hpp) times that of
/// the best order.
/// 4. That order once more on the whole record.
/// Before them the delays: those whose inputs the pole sets explain best. They are kept where the model without them is
/// worse, held out, by more than kDelayMargin, or needs a higher order to be as good.
///
/// @param u m x N   @param y p x N, both centred and of unit RMS a channel   @param order 0: to be found
/// Status: rank_deficient if no order gave a model.
/// Cost: a refinement for each order up to four beyond the last that brought anything, on at most 16384 samples.
LinearSearch search_linear(ConstMatrixRef u, ConstMatrixRef y, Index order, const LinearSearchOptions& options,
                           const Solver& solver);

/// Step 5 of the pipeline for a model that was found by search_linear(): the linear model of further inputs by the best
/// of the pole sets of the order given and of the poles that are known.
class KnownPoles final : public SubspaceEstimator {
 public:
  /// @param found borrowed; what identify() returns for its own inputs
  KnownPoles(const LinearEstimate& found, Index block_rows) : found_(found), block_rows_(block_rows) {}
  std::string name() const override { return "search"; }
  RecordNeeds needs(Index inputs, Index outputs) const override;
  LinearEstimate identify(ConstMatrixRef u, ConstMatrixRef y, Index order) const override;

 private:
  const LinearEstimate& found_;
  Index block_rows_;
};

}  // namespace wheelhop
