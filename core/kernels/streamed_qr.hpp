/// \file
/// Triangular factor of a tall matrix that arrives in row blocks; memory does not grow with the number of rows.
#pragma once

#include "core/base/linalg.hpp"

namespace wheelhop {

/// R of  A = Q R  for A (rows x columns) fed block by block, by Householder reflections of [R; block].
/// Orthogonal throughout: no Gram matrix, so the accuracy depends on cond(A), not on its square.
class StreamedQr {
 public:
  /// @param columns width of A   @param block_rows rows gathered before a reflection sweep; default 4 * columns
  explicit StreamedQr(Index columns, Index block_rows = 0);

  /// Space for the next `rows` rows (rows <= capacity()); fill it before the next call.
  MatrixRef next(Index rows);
  Index capacity() const { return buffer_.rows() - buffer_.cols(); }
  /// R (columns x columns), upper triangular, diagonal non-negative. Cost of the whole: O(rows columns^2).
  Matrix finish();

 private:
  void reduce();
  Matrix buffer_;
  Index used_;  // rows of the buffer in use, R included
};

/// min ||A x - b|| from the R factor of [A b] (columns of A first). @param unknowns columns of A
LeastSquares solve_from_qr(ConstMatrixRef R, Index unknowns, double tolerance = 1e-12);

}  // namespace wheelhop
