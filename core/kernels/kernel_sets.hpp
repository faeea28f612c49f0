/// \file
/// The functions behind correlation.hpp, cholesky.hpp and dare.hpp, by instruction set. `count` is a multiple of 8, and
/// so is `stride`.
#pragma once

#include <cstddef>

namespace wheelhop {

using PlainCorrelations = void(const double* const* fixed, std::ptrdiff_t fixed_count, const double* moving,
                               std::ptrdiff_t lags, std::ptrdiff_t count, double* sums);
using ExtendedCorrelations = void(const double* const* fixed, std::ptrdiff_t fixed_count, const double* moving,
                                  std::ptrdiff_t lags, std::ptrdiff_t count, double* high, double* low);
using PlainCholesky = bool(double* a, std::ptrdiff_t n, std::ptrdiff_t stride);
using ExtendedCholesky = bool(double* high, double* low, std::ptrdiff_t n, std::ptrdiff_t stride, double least_pivot);

/// How a doubling ended.
struct DoublingEnd {
  int doublings = 0;
  double power = 0;  ///< Frobenius norm of the 2^doublings-th power of the closed loop
  bool finite = true;
};
/// A <- A (I + G H)^-1 A,  G <- G + A (I + G H)^-1 G A',  H <- H + A' H (I + G H)^-1 A  until ||A||_F^2 is at most
/// `round_off` or `most` doublings are done; `h` is then the solution, and `a` is lost.
/// @param a, g, h stride x stride, the last stride - n rows and columns zero, aligned to 64 bytes
/// @param work doubling_work(stride) zeros   @param n at most kMostDoubled
using Doubling = DoublingEnd(double* a, double* g, double* h, double* work, std::ptrdiff_t n, std::ptrdiff_t stride,
                             int most, double round_off);
/// Larger matrices outgrow the caches: at n = 200 products in blocks are a fifth faster than the loops with AVX2, and a
/// fifth slower than those with AVX-512; at n = 100 both loops are faster.
constexpr std::ptrdiff_t kMostDoubled = 128;
constexpr std::ptrdiff_t doubling_work(std::ptrdiff_t stride) { return 5 * stride * stride; }

PlainCorrelations plain_avx2, plain_avx512, plain_portable;
ExtendedCorrelations extended_avx2, extended_avx512, extended_portable;
PlainCholesky plain_cholesky_avx2, plain_cholesky_avx512, plain_cholesky_portable;
ExtendedCholesky extended_cholesky_avx2, extended_cholesky_avx512, extended_cholesky_portable;
Doubling doubling_avx2, doubling_avx512;

/// The widest set that this processor has.
enum class KernelSet { portable, avx2, avx512 };
inline KernelSet kernel_set() {
#ifdef __x86_64__
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq")) return KernelSet::avx512;
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return KernelSet::avx2;
#endif
  return KernelSet::portable;
}

/// Of three functions the one for this processor.
template <class Function>
Function* widest(Function* portable, [[maybe_unused]] Function* avx2, [[maybe_unused]] Function* avx512) {
#ifdef __x86_64__
  if (kernel_set() == KernelSet::avx512) return avx512;
  if (kernel_set() == KernelSet::avx2) return avx2;
#endif
  return portable;
}

}  // namespace wheelhop
