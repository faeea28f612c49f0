// Compiled with AVX2 and -ffp-contract=off.
#include <immintrin.h>

#include "core/kernels/correlation_loops.hpp"
#include "core/kernels/correlation_sets.hpp"

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
  [[gnu::always_inline]] void add_product(const Avx2& x, const Avx2& y) {
    a = _mm256_fmadd_pd(x.a, y.a, a);
    b = _mm256_fmadd_pd(x.b, y.b, b);
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

}  // namespace wheelhop
