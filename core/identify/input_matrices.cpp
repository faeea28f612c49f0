#include "core/identify/input_matrices.hpp"

#include "core/identify/modal_features.hpp"
#include "core/kernels/streamed_qr.hpp"

namespace wheelhop {
namespace {

InputMatrices assemble(ConstMatrixRef A, ConstMatrixRef C, Index inputs, Index direct_inputs, const Vector& x,
                       const LeastSquares& solution) {
  const Index n = A.rows(), p = C.rows(), m = inputs, at_x0 = n * m, at_D = at_x0 + n;
  InputMatrices result;
  result.model.A = A;
  result.model.C = C;
  result.model.B = x.head(n * m).reshaped(n, m);
  result.model.D = Matrix::Zero(p, m);
  result.model.D.leftCols(direct_inputs) = x.segment(at_D, p * direct_inputs).reshaped(p, direct_inputs);
  result.model.y0 = x.tail(p);
  result.x0 = x.segment(at_x0, n);
  result.rank = solution.rank;
  result.condition = solution.condition;
  return result;
}

/// The regression in modal coordinates, where B, x0 and D act on few common features:
///   y_k = sum over modes and inputs of (C T)_mode (beta f)_k + ... , B = T beta, x0 = T xi.
InputMatrices by_modes(const Modes& modes, ConstMatrixRef A, ConstMatrixRef C, ConstMatrixRef u, ConstMatrixRef y,
                       Index direct_inputs) {
  const Index n = A.rows(), p = C.rows(), m = u.rows();
  ModalFeatures features(modes, u, y, direct_inputs);
  const Matrix R = features.factor();
  const Index count = features.count(), unknowns = n * m + n + p * direct_inputs + p;
  const Matrix of_modes = C * modes.T;
  Matrix L = Matrix::Zero(p * count, unknowns);
  Vector target(p * count);
  for (Index o = 0; o < p; ++o) {
    auto rows = L.middleRows(o * count, count);
    target.segment(o * count, count) = R.col(count + o).head(count);
    for (Index j = 0; j <= m; ++j)
      for (const Modes::Block& block : modes.blocks) {
        const Index at = j * n + block.first;
        const auto re = R.col(at).head(count);
        const double c1 = of_modes(o, block.first);
        if (!block.is_pair) {
          rows.col(at) = c1 * re;
          continue;
        }
        const auto im = R.col(at + 1).head(count);
        const double c2 = of_modes(o, block.first + 1);
        rows.col(at) = c1 * re + c2 * im;
        rows.col(at + 1) = c2 * re - c1 * im;
      }
    for (Index j = 0; j < direct_inputs; ++j)
      rows.col(n * m + n + j * p + o) = R.col(features.at_direct() + j).head(count);
    rows.col(unknowns - p + o) = R.col(count - 1).head(count);
  }
  const LeastSquares solution = least_squares(L, target);
  Vector x = solution.x.col(0);
  x.head(n * m + n).reshaped(n, m + 1) = modes.T * Matrix(x.head(n * m + n).reshaped(n, m + 1));
  return assemble(A, C, m, direct_inputs, x, solution);
}

/// The regression with the derivatives of the simulated outputs as its columns, for any A.
InputMatrices by_derivatives(ConstMatrixRef A, ConstMatrixRef C, ConstMatrixRef u, ConstMatrixRef y,
                             Index direct_inputs) {
  const Index n = A.rows(), p = C.rows(), m = u.rows(), N = u.cols();
  // Columns: B (n m, column-major), x0 (n), D (p m, column-major), y0 (p), then y itself.
  const Index at_x0 = n * m, at_D = at_x0 + n, at_y0 = at_D + p * direct_inputs, unknowns = at_y0 + p;
  StreamedQr stream(unknowns + 1, 512);
  // Z = dx_k/d[B, x0]: n x (n m + n); Z_{k+1} = A Z_k + [u_k' (x) I, 0].
  Matrix Z = Matrix::Zero(n, at_D), next(n, at_D), CZ(p, at_D);
  Z.rightCols(n).setIdentity();
  const Index block_samples = std::max<Index>(1, stream.capacity() / p);
  for (Index first = 0; first < N; first += block_samples) {
    const Index count = std::min(block_samples, N - first);
    MatrixRef block = stream.next(count * p);
    block.setZero();
    for (Index k = 0; k < count; ++k) {
      const auto u_k = u.col(first + k);
      auto rows = block.middleRows(k * p, p);
      rows.leftCols(at_D).noalias() = C * Z;
      for (Index j = 0; j < direct_inputs; ++j) rows.middleCols(at_D + j * p, p).diagonal().setConstant(u_k(j));
      rows.middleCols(at_y0, p).setIdentity();
      rows.col(unknowns) = y.col(first + k);
      next.noalias() = A * Z;
      for (Index j = 0; j < m; ++j) next.middleCols(j * n, n).diagonal().array() += u_k(j);
      Z.swap(next);
    }
    drop_faded(Z.rightCols(n));
  }
  const LeastSquares solution = solve_from_qr(stream.finish(), unknowns);
  return assemble(A, C, m, direct_inputs, solution.x.col(0), solution);
}

}  // namespace

InputMatrices estimate_input_matrices(ConstMatrixRef A, ConstMatrixRef C, ConstMatrixRef u, ConstMatrixRef y,
                                      Index direct_inputs) {
  const std::optional<Modes> modes = separate_modes(A);
  return modes ? by_modes(*modes, A, C, u, y, direct_inputs) : by_derivatives(A, C, u, y, direct_inputs);
}

void estimate_start(ConstMatrixRef u, ConstMatrixRef y, LinearModel& model, Vector& x0) {
  const Index n = model.order(), p = model.output_count(), N = u.cols();
  model.y0 = Vector::Zero(p);
  const Matrix residual = y - simulated_outputs(model, u, Vector::Zero(n));
  StreamedQr stream(n + p + 1, 512);
  const Index block_samples = std::max<Index>(1, stream.capacity() / p);
  Matrix free = model.C;  // C A^k
  for (Index first = 0; first < N; first += block_samples) {
    const Index count = std::min(block_samples, N - first);
    MatrixRef block = stream.next(count * p);
    block.setZero();
    for (Index k = 0; k < count; ++k, free = free * model.A) {
      auto rows = block.middleRows(k * p, p);
      rows.leftCols(n) = free;
      rows.middleCols(n, p).setIdentity();
      rows.col(n + p) = residual.col(first + k);
    }
    drop_faded(free);
  }
  const Vector start = solve_from_qr(stream.finish(), n + p).x.col(0);
  x0 = start.head(n);
  model.y0 = start.tail(p);
}

Vector estimate_initial_state(const LinearModel& model, ConstMatrixRef u, ConstMatrixRef y, Index samples, Index skip) {
  const Index end = std::min(skip + samples, u.cols());
  const Index n = model.order(), p = model.output_count();
  const Matrix residual = y.leftCols(end) - simulated_outputs(model, u.leftCols(end), Vector::Zero(n));
  Matrix observability(p * (end - skip), n);
  Matrix row = model.C;
  for (Index k = 0; k < end; ++k) {
    if (k >= skip) observability.middleRows(p * (k - skip), p) = row;
    row = row * model.A;
  }
  return least_squares(observability, residual.rightCols(end - skip).reshaped(), 1e-10).x.col(0);
}

}  // namespace wheelhop
