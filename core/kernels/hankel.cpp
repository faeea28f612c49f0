#include "core/kernels/hankel.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>

#include "core/kernels/streamed_qr.hpp"

namespace wheelhop {

Matrix hankel_factor(const std::vector<HankelBlock>& blocks) {
  Index rows = 1, columns = std::numeric_limits<Index>::max();
  for (const HankelBlock& block : blocks) {
    rows += block.signal.rows() * block.rows;
    columns = std::min(columns, block.signal.cols() - block.first - block.rows + 1);
  }
  if (columns < rows) throw std::invalid_argument("hankel_factor: fewer columns than rows");
  // The QR of the transpose: each column of the Hankel stack is one row fed to the stream. Signals are stored one
  // column a sample, so the stack of consecutive samples is contiguous memory.
  StreamedQr stream(rows);
  for (Index first = 0; first < columns;) {
    const Index count = std::min(stream.capacity(), columns - first);
    MatrixRef filled = stream.next(count);
    for (Index k = 0; k < count; ++k) {
      filled(k, 0) = 1;
      Index at = 1;
      for (const HankelBlock& block : blocks) {
        const Index width = block.signal.rows() * block.rows;
        filled.row(k).segment(at, width) =
            block.signal.middleCols(first + k + block.first, block.rows).reshaped().transpose();
        at += width;
      }
    }
    first += count;
  }
  return stream.finish().transpose();
}

HankelRq hankel_rq(ConstMatrixRef u, ConstMatrixRef y, Index future, Index past, bool past_outputs) {
  std::vector<HankelBlock> blocks = {{u, past, future}, {u, 0, past}};
  if (past_outputs) blocks.push_back({y, 0, past});
  blocks.push_back({y, past, future});
  return {hankel_factor(blocks), future, past, u.rows(), y.rows(), past_outputs, u.cols() - future - past + 1};
}

Index persistency_of_excitation(ConstMatrixRef u, Index limit, double tolerance) {
  const Index m = u.rows();
  limit = std::min(limit, (u.cols() + 1) / (m + 1));
  if (limit < 1 || !all_finite(u)) return 0;
  StreamedQr stream(m * limit);
  const Index columns = u.cols() - limit + 1;
  for (Index first = 0; first < columns;) {
    const Index count = std::min(stream.capacity(), columns - first);
    MatrixRef block = stream.next(count);
    for (Index k = 0; k < count; ++k) block.row(k) = u.middleCols(first + k, limit).reshaped().transpose();
    first += count;
  }
  const Matrix R = stream.finish();
  // Leading m s columns of R belong to s block rows. Full rank is inherited by leading blocks: bisection.
  Index low = 0, high = limit;
  while (low < high) {
    const Index s = (low + high + 1) / 2;
    const Vector values = svd(R.topLeftCorner(m * s, m * s)).s;
    if (values(0) > 0 && values(m * s - 1) > tolerance * values(0))
      low = s;
    else
      high = s - 1;
  }
  return low;
}

}  // namespace wheelhop
