/// \file
/// What every subspace method does: the triangular factor of the block-Hankel matrices, an order, A and C, then B, D,
/// x0 and y0. Methods differ in their instruments, their weighting and how they recover the matrices.
#pragma once

#include "core/base/options.hpp"
#include "core/identify/pieces.hpp"
#include "core/kernels/hankel.hpp"

namespace wheelhop {

/// Options of every method on block-Hankel matrices.
struct HankelOptions {
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

/// Column space of the extended observability matrix as a method sees it.
struct ColumnSpace {
  Matrix weighted;              ///< p s x k, whose left singular vectors are taken
  Matrix unweight;              ///< p s x p s, Gamma = unweight U S^(1/2); empty: the identity
  Index instruments = 0;        ///< directions of the instruments that were used
  double instrument_condition;  ///< largest over smallest singular value of those directions
};

/// @param directions descending singular values of the instruments beyond [1; U_future]
/// @param tolerance those below it times the first are not used
/// @return how many are used: at least 1 if any is positive
Index used_directions(ConstVectorRef directions, double tolerance);

/// The shared step; a method overrides column_space() and recover().
/// Cost O(N (m + p)^2 (s + s_past)^2) for the triangular factor, with which the singular values do not depend on N.
class HankelEstimator : public SubspaceEstimator {
 public:
  RecordNeeds needs(Index inputs, Index outputs) const final;
  LinearEstimate identify(ConstMatrixRef u, ConstMatrixRef y, Index order) const final;

 protected:
  /// @param past_outputs whether Y_past is among the instruments
  HankelEstimator(HankelOptions options, bool past_outputs);

  /// The weighted column space. Default: that of Y_future along the instruments (MOESP, eq. 11).
  virtual ColumnSpace column_space(const HankelRq& rq) const;

  /// Fills model, x0, stabilised and condition of the estimate. Default: A and C by shift invariance (eq. 8), B, D, x0
  /// and y0 by simulated_outputs().
  /// @param gamma p s x n extended observability matrix
  /// @return why the record does not determine them; empty where it does
  virtual std::string recover(const HankelRq& rq, ConstMatrixRef gamma, ConstMatrixRef u, ConstMatrixRef y,
                              LinearEstimate& estimate) const;

  /// Fills the estimate's model with A and C as given and with B, D, y0 by least squares on the simulated outputs, its
  /// x0 and its condition. @return as recover()
  static std::string simulated_outputs(const Matrix& A, const Matrix& C, ConstMatrixRef u, ConstMatrixRef y,
                                       LinearEstimate& estimate);

 private:
  HankelOptions options_;
  bool past_outputs_;
};

}  // namespace wheelhop
