/// \file
/// A and C of a linear model without knowing the time scales of its modes: MOESP with past inputs on block averages of
/// several lengths, each of which sees the modes whose periods it spans.
#pragma once

#include <vector>

#include "core/base/linalg.hpp"

namespace wheelhop {

/// A record at a lower rate: block j holds samples j q .. (j + 1) q - 1.
///   u: the first `moments` Legendre moments of every input over the block, row r m + i the r-th of input i;
///   y: the mean of every output over the block.
/// A state that moves slowly inside a block is driven by the moments as by the inputs themselves: with x_j the state at
/// the start of block j, x_{j+1} = A^q x_j + (B's on the moments), mean y_j = C (1/q) sum A^i x_j + (D's on the
/// moments), exact where q <= moments, else up to (w T / 2)^moments / moments! for a mode of frequency w and a block of
/// duration T. Averaging also takes out the noise above the block rate.
struct BlockAverages {
  Index stride = 1;
  Matrix u;  ///< m r x floor(N / q)
  Matrix y;  ///< p x floor(N / q)
};

/// @param u m x N   @param y p x N   @param stride q, 1 <= q <= N   @param moments r, at most q of them are taken
BlockAverages block_averages(ConstMatrixRef u, ConstMatrixRef y, Index stride, Index moments);

/// A and C of a record at its own rate.
struct PoleSet {
  Matrix A;          ///< n x n, spectral radius < 1
  Matrix C;          ///< p x n
  Index stride = 1;  ///< block length it was found at
};

struct PoleSearchOptions {
  Index lowest_order = 1, highest_order = 10;
  Index block_rows = 20;  ///< s and the instruments' at every block length; fewer where the record is too short
  Index gap = 0;          ///< samples between the instruments and the future: input delays up to so many do no harm
};

/// Sets of every order from lowest to highest, [order - lowest][candidate]. Block lengths 1, 2, 4, ... as long as the
/// record has columns enough. An order that the instruments do not carry has no candidates.
///
/// Delays: with inputs that act d_i samples late the outputs from k on are C A^i x_k plus terms in the inputs from
/// k - d_i on. The inputs of the last `gap` >= d_i samples are projected out with the future ones, so that what the
/// older inputs explain is C A^i x_k alone, whatever the delays.
/// Cost: a block-Hankel factor for each length, together about twice that of the shortest.
std::vector<std::vector<PoleSet>> pole_sets(ConstMatrixRef u, ConstMatrixRef y, const PoleSearchOptions& options);

}  // namespace wheelhop
