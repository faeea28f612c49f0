/// \file
/// Linear discrete-time state-space model  x_{k+1} = A x_k + B u_k,  y_k = C x_k + D u_k + y0.
#pragma once

#include "core/base/linalg.hpp"

namespace wheelhop {

struct LinearModel {
  Matrix A;   ///< n x n
  Matrix B;   ///< n x m
  Matrix C;   ///< p x n
  Matrix D;   ///< p x m
  Vector y0;  ///< p output offset

  Index order() const { return A.rows(); }
  Index input_count() const { return B.cols(); }
  Index output_count() const { return C.rows(); }
};

struct Response {
  Matrix x;  ///< n x N states
  Matrix y;  ///< p x N outputs
};

/// Free-run simulation. @param u m x N   @param x0 n. Cost O(N (n + p)(n + m)).
Response simulate(const LinearModel& model, ConstMatrixRef u, ConstVectorRef x0);

/// simulate().y, p x N, without keeping the states of the whole record.
Matrix simulated_outputs(const LinearModel& model, ConstMatrixRef u, ConstVectorRef x0);

/// Markov parameters D, CB, CAB, ... as p x (m count), the first `count` of them.
Matrix markov_parameters(const LinearModel& model, Index count);

/// Model of the same behaviour in the coordinates x_new = T x. @param T n x n, invertible.
LinearModel similarity_transform(const LinearModel& model, ConstMatrixRef T);

/// A with every eigenvalue of modulus >= 1 reflected to its inverse (and shrunk below `limit`), eigenvectors kept.
/// Leaves a stable A untouched, bit for bit. A free run of an unstable linear part would diverge, while the magnitude
/// of the frequency response of a reflected pole differs by a constant only.
Matrix stabilised(ConstMatrixRef A, double limit = 0.9999);

}  // namespace wheelhop
