// Compiled with -ffp-contract=off: what a fused multiply-add does is written out, and nothing else is fused.
#include "core/kernels/cholesky.hpp"

#include <stdexcept>

#include "core/kernels/cholesky_loops.hpp"
#include "core/kernels/kernel_sets.hpp"

namespace wheelhop {
namespace {

/// Eight lanes of any processor.
struct Portable {
  double lanes[8];
  static Portable load(const double* p) {
    Portable v;
    for (int i = 0; i < 8; ++i) v.lanes[i] = p[i];
    return v;
  }
  static Portable all(double x) {
    Portable v;
    for (double& lane : v.lanes) lane = x;
    return v;
  }
  void store(double* p) const {
    for (int i = 0; i < 8; ++i) p[i] = lanes[i];
  }
  Portable times(const Portable& y) const {
    Portable v;
    for (int i = 0; i < 8; ++i) v.lanes[i] = lanes[i] * y.lanes[i];
    return v;
  }
  void subtract_product(const Portable& x, const Portable& y) {
    for (int i = 0; i < 8; ++i) lanes[i] = std::fma(-x.lanes[i], y.lanes[i], lanes[i]);
  }
  static void subtract_extended(Portable& sum, Portable& rest, const Portable& high, const Portable& low,
                                const Portable& by_high, const Portable& by_low) {
    for (int i = 0; i < 8; ++i) {
      const double p = high.lanes[i] * by_high.lanes[i];
      const double e = std::fma(high.lanes[i], by_high.lanes[i], -p) +
                       (high.lanes[i] * by_low.lanes[i] + low.lanes[i] * by_high.lanes[i]);
      const double s = sum.lanes[i] - p, z = s - sum.lanes[i];
      rest.lanes[i] += ((sum.lanes[i] - (s - z)) - (p + z)) - e;
      sum.lanes[i] = s;
    }
  }
};

}  // namespace

bool plain_cholesky_portable(double* a, std::ptrdiff_t n, std::ptrdiff_t stride) {
  return plain_cholesky<Portable, 4, 1>(a, n, stride);
}

bool extended_cholesky_portable(double* high, double* low, std::ptrdiff_t n, std::ptrdiff_t stride,
                                double least_pivot) {
  return extended_cholesky<Portable, 4>(high, low, n, stride, least_pivot);
}

namespace {

#ifdef __x86_64__
PlainCholesky* const plain = widest(plain_cholesky_portable, plain_cholesky_avx2, plain_cholesky_avx512);
ExtendedCholesky* const extended = widest(extended_cholesky_portable, extended_cholesky_avx2, extended_cholesky_avx512);
#else
PlainCholesky* const plain = plain_cholesky_portable;
ExtendedCholesky* const extended = extended_cholesky_portable;
#endif

void require_whole_groups(const MatrixRef& a) {
  if (a.rows() != cholesky_stride(a.cols()) || a.outerStride() != a.rows())
    throw std::invalid_argument("cholesky: cholesky_stride(n) x n, stored without gaps");
}

}  // namespace

bool cholesky_plain(MatrixRef a) {
  require_whole_groups(a);
  return plain(a.data(), a.cols(), a.outerStride());
}

bool cholesky_extended(MatrixRef high, MatrixRef low, double least_pivot) {
  require_whole_groups(high);
  require_whole_groups(low);
  return extended(high.data(), low.data(), high.cols(), high.outerStride(), least_pivot);
}

}  // namespace wheelhop
