#include "core/kernels/hankel.hpp"

#include <stdexcept>

#include "core/kernels/streamed_qr.hpp"

namespace wheelhop {

HankelRq hankel_rq(ConstMatrixRef u, ConstMatrixRef y, Index future, Index past) {
  const Index m = u.rows(), p = y.rows(), N = u.cols();
  const Index rows = 1 + m * (future + past) + p * future;
  const Index columns = N - future - past + 1;
  if (columns < rows) throw std::invalid_argument("hankel_rq: fewer columns than rows");
  // The QR of the transpose: each column of the Hankel stack is one row fed to the stream. Both signals are stored one
  // column a sample, so the stack of consecutive samples is contiguous memory.
  StreamedQr stream(rows);
  for (Index first = 0; first < columns;) {
    const Index count = std::min(stream.capacity(), columns - first);
    MatrixRef block = stream.next(count);
    for (Index k = 0; k < count; ++k) {
      const Index t = first + k;
      block(k, 0) = 1;
      block.row(k).segment(1, m * future) = u.middleCols(t + past, future).reshaped().transpose();
      block.row(k).segment(1 + m * future, m * past) = u.middleCols(t, past).reshaped().transpose();
      block.row(k).tail(p * future) = y.middleCols(t + past, future).reshaped().transpose();
    }
    first += count;
  }
  return {stream.finish().transpose(), future, past, m, p, columns};
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
