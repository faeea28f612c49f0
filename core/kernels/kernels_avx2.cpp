// Compiled with AVX2 and -ffp-contract=off.
#include <immintrin.h>

#include "core/kernels/cholesky_loops.hpp"
#include "core/kernels/correlation_loops.hpp"
#include "core/kernels/doubling_loops.hpp"
#include "core/kernels/kernel_sets.hpp"

namespace wheelhop {
namespace {

/// Eight lanes in two registers.
struct Avx2 {
  __m256d a, b;
  [[gnu::always_inline]] static Avx2 zero() { return {_mm256_setzero_pd(), _mm256_setzero_pd()}; }
  [[gnu::always_inline]] static Avx2 load(const double* p) { return {_mm256_loadu_pd(p), _mm256_loadu_pd(p + 4)}; }
  [[gnu::always_inline]] void store(double* p) const {
    _mm256_storeu_pd(p, a);
    _mm256_storeu_pd(p + 4, b);
  }
  template <int L>
  [[gnu::always_inline]] static Avx2 at(const Avx2&, const Avx2&, const double* here) {
    return load(here + L);
  }
  [[gnu::always_inline]] double total() const {
    const __m256d half = _mm256_add_pd(a, b);
    const __m128d quarter = _mm_add_pd(_mm256_castpd256_pd128(half), _mm256_extractf128_pd(half, 1));
    return _mm_cvtsd_f64(_mm_add_sd(quarter, _mm_unpackhi_pd(quarter, quarter)));
  }
  [[gnu::always_inline]] void add_product(const Avx2& x, const Avx2& y) {
    a = _mm256_fmadd_pd(x.a, y.a, a);
    b = _mm256_fmadd_pd(x.b, y.b, b);
  }
  [[gnu::always_inline]] static Avx2 all(double x) { return {_mm256_set1_pd(x), _mm256_set1_pd(x)}; }
  [[gnu::always_inline]] Avx2 times(const Avx2& x) const { return {_mm256_mul_pd(a, x.a), _mm256_mul_pd(b, x.b)}; }
  [[gnu::always_inline]] void subtract_product(const Avx2& x, const Avx2& y) {
    a = _mm256_fnmadd_pd(x.a, y.a, a);
    b = _mm256_fnmadd_pd(x.b, y.b, b);
  }
  [[gnu::always_inline]] static void subtract_extended(__m256d& sum, __m256d& rest, __m256d high, __m256d low,
                                                       __m256d by_high, __m256d by_low) {
    const __m256d p = _mm256_mul_pd(high, by_high);
    const __m256d cross = _mm256_add_pd(_mm256_mul_pd(high, by_low), _mm256_mul_pd(low, by_high));
    const __m256d e = _mm256_add_pd(_mm256_fmsub_pd(high, by_high, p), cross);
    const __m256d s = _mm256_sub_pd(sum, p), z = _mm256_sub_pd(s, sum);
    const __m256d rounded = _mm256_sub_pd(_mm256_sub_pd(sum, _mm256_sub_pd(s, z)), _mm256_add_pd(p, z));
    rest = _mm256_add_pd(rest, _mm256_sub_pd(rounded, e));
    sum = s;
  }
  [[gnu::always_inline]] static void subtract_extended(Avx2& sum, Avx2& rest, const Avx2& high, const Avx2& low,
                                                       const Avx2& by_high, const Avx2& by_low) {
    subtract_extended(sum.a, rest.a, high.a, low.a, by_high.a, by_low.a);
    subtract_extended(sum.b, rest.b, high.b, low.b, by_high.b, by_low.b);
  }
  [[gnu::always_inline]] static void add_exactly(__m256d& high, __m256d& low, __m256d x, __m256d y) {
    const __m256d p = _mm256_mul_pd(x, y), e = _mm256_fmsub_pd(x, y, p);
    const __m256d s = _mm256_add_pd(high, p), z = _mm256_sub_pd(s, high);
    const __m256d rounded = _mm256_add_pd(_mm256_sub_pd(high, _mm256_sub_pd(s, z)), _mm256_sub_pd(p, z));
    low = _mm256_add_pd(low, _mm256_add_pd(e, rounded));
    high = s;
  }
  [[gnu::always_inline]] static void add_exactly(Avx2& high, Avx2& low, const Avx2& x, const Avx2& y) {
    add_exactly(high.a, low.a, x.a, y.a);
    add_exactly(high.b, low.b, x.b, y.b);
  }
};

}  // namespace

void plain_avx2(const double* const* fixed, Count fixed_count, const double* moving, Count lags, Count count,
                double* sums) {
  Count f = 0;
  for (; f + 2 <= fixed_count; f += 2) all_lags<Avx2, 2, 3>(fixed + f, moving, lags, count, sums + f * lags);
  if (f < fixed_count) all_lags<Avx2, 1, 4>(fixed + f, moving, lags, count, sums + f * lags);
}

void extended_avx2(const double* const* fixed, Count fixed_count, const double* moving, Count lags, Count count,
                   double* high, double* low) {
  for (Count f = 0; f < fixed_count; ++f)
    all_lags_extended<Avx2, 2>(fixed[f], moving, lags, count, high + f * lags, low + f * lags);
}

bool plain_cholesky_avx2(double* a, Count n, Count stride) { return plain_cholesky<Avx2, 4, 1>(a, n, stride); }

bool extended_cholesky_avx2(double* high, double* low, Count n, Count stride, double least_pivot) {
  return extended_cholesky<Avx2, 2>(high, low, n, stride, least_pivot);
}

DoublingEnd doubling_avx2(double* a, double* g, double* h, double* work, Count n, Count stride, int most,
                          double round_off) {
  return doubling<Avx2, 1>(a, g, h, work, n, stride, most, round_off);
}

}  // namespace wheelhop
