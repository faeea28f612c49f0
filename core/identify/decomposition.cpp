#include "core/identify/decomposition.hpp"

#include <cmath>

#include "core/kernels/streamed_qr.hpp"

namespace wheelhop {

Decomposition decompose(ConstMatrixRef x, ConstMatrixRef u, double threshold) {
  const Index n = x.rows(), m = u.rows(), columns = x.cols() - 1, inputs = 1 + m, width = inputs + 2 * n;
  StreamedQr stream(width, 512);
  for (Index first = 0; first < columns;) {
    const Index count = std::min(stream.capacity(), columns - first);
    MatrixRef block = stream.next(count);
    block.col(0).setOnes();
    block.middleCols(1, m) = u.middleCols(first, count).transpose();
    block.middleCols(inputs, n) = x.middleCols(first, count).transpose();
    block.rightCols(n) = x.middleCols(first + 1, count).transpose();
    first += count;
  }
  const Matrix r = stream.finish().transpose();
  const Matrix r11 = r.topLeftCorner(inputs, inputs), r21 = r.block(inputs, 0, n, inputs);
  const Matrix r22 = r.block(inputs, inputs, n, n), r31 = r.block(inputs + n, 0, n, inputs);
  const Matrix r32 = r.block(inputs + n, inputs, n, n);
  Decomposition result;
  result.r33 = r.bottomRightCorner(n, n);
  // X = R L^-1 by the transposed triangular systems.
  result.A = solve(r22.transpose(), r32.transpose()).transpose();
  const Matrix with_constant = solve(r11.transpose(), (r31 - result.A * r21).transpose()).transpose();
  result.B = with_constant.rightCols(m);
  const double scale = std::sqrt(static_cast<double>(columns));
  result.singular_values = singular_values(result.r33) / scale;
  for (const double value : result.singular_values)
    if (value > threshold * result.singular_values(0)) ++result.rank;
  const double total = std::sqrt(r31.squaredNorm() + r32.squaredNorm() + result.r33.squaredNorm());
  result.share = total > 0 ? result.r33.norm() / total : 0;
  return result;
}

}  // namespace wheelhop
