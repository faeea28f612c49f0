/// \file
/// What drives the modes of a known A: one filter a mode and input, of which every column of B, the initial state, D
/// and the offset are linear combinations.
#pragma once

#include <optional>
#include <vector>

#include "core/base/linalg.hpp"

namespace wheelhop {

/// A = T J T^-1 with J of blocks: a real eigenvalue, or [a b; -b a] for a pair a +- ib.
struct Modes {
  struct Block {
    Index first;   ///< column of T
    double a, b;   ///< b = 0 of a real eigenvalue
    bool is_pair;  ///< two columns: real and imaginary part of the eigenvector
  };
  Matrix T;  ///< n x n, columns of a block of unit length together
  std::vector<Block> blocks;
};

/// The modes of A (n x n), unless its eigenvectors are too nearly dependent to tell them apart: reciprocal condition
/// of T below 1e-8, a judgement that leaves half of the digits. Cost O(n^3).
std::optional<Modes> separate_modes(ConstMatrixRef A);

/// Features of a record, a row each, chunk by chunk: for each input and mode the filtered input f,
///   f_{k+1} = conj(lambda) f_k + u_k, f_0 = 0  (real and imaginary part of a pair), n m rows;
/// then conj(lambda)^k, n rows; then the inputs with a direct term; then 1; then the outputs.
/// Cost O(n m + n) a sample.
class ModalFeatures {
 public:
  /// All by reference. @param u m x N  @param y p x N
  ModalFeatures(const Modes& modes, ConstMatrixRef u, ConstMatrixRef y, Index direct_inputs);

  Index count() const { return at_y_; }  ///< rows before the outputs
  Index at_start() const { return at_start_; }
  Index at_direct() const { return at_direct_; }

  /// Triangular factor R of the features and outputs over all samples, (count + p) columns: by their moments where
  /// these are exact enough, else by reflections.
  Matrix factor();

 private:
  bool next();  // the next chunk, false after the last
  void restart();
  std::optional<Matrix> factor_of_moments();

  const Modes& modes_;
  const ConstMatrixRef u_, y_;
  Index at_start_, at_direct_, at_one_, at_y_, rows_;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> chunk_;
  Vector state_;  // the filters' at the start of the next chunk
  Index first_ = 0, filled_ = 0;
};

}  // namespace wheelhop
