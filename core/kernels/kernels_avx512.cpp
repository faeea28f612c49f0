// Compiled with AVX-512 and -ffp-contract=off; called where the processor has it.
#include <immintrin.h>

#include "core/kernels/cholesky_loops.hpp"
#include "core/kernels/correlation_loops.hpp"
#include "core/kernels/doubling_loops.hpp"
#include "core/kernels/kernel_sets.hpp"

namespace wheelhop {
namespace {

struct Avx512 {
  __m512d a;
  [[gnu::always_inline]] static Avx512 zero() { return {_mm512_setzero_pd()}; }
  [[gnu::always_inline]] static Avx512 load(const double* p) { return {_mm512_loadu_pd(p)}; }
  [[gnu::always_inline]] void store(double* p) const { _mm512_storeu_pd(p, a); }
  template <int L>
  [[gnu::always_inline]] static Avx512 at(const Avx512& here, const Avx512& next, const double*) {
    if constexpr (L == 0) return here;
    return {_mm512_castsi512_pd(_mm512_alignr_epi64(_mm512_castpd_si512(next.a), _mm512_castpd_si512(here.a), L))};
  }
  [[gnu::always_inline]] double total() const {
    const __m256d half = _mm256_add_pd(_mm512_castpd512_pd256(a), _mm512_extractf64x4_pd(a, 1));
    const __m128d quarter = _mm_add_pd(_mm256_castpd256_pd128(half), _mm256_extractf128_pd(half, 1));
    return _mm_cvtsd_f64(_mm_add_sd(quarter, _mm_unpackhi_pd(quarter, quarter)));
  }
  [[gnu::always_inline]] void add_product(const Avx512& x, const Avx512& y) { a = _mm512_fmadd_pd(x.a, y.a, a); }
  [[gnu::always_inline]] static Avx512 all(double x) { return {_mm512_set1_pd(x)}; }
  [[gnu::always_inline]] Avx512 times(const Avx512& x) const { return {_mm512_mul_pd(a, x.a)}; }
  [[gnu::always_inline]] void subtract_product(const Avx512& x, const Avx512& y) { a = _mm512_fnmadd_pd(x.a, y.a, a); }
  [[gnu::always_inline]] static void subtract_extended(Avx512& sum, Avx512& rest, const Avx512& high, const Avx512& low,
                                                       const Avx512& by_high, const Avx512& by_low) {
    const __m512d p = _mm512_mul_pd(high.a, by_high.a);
    const __m512d cross = _mm512_add_pd(_mm512_mul_pd(high.a, by_low.a), _mm512_mul_pd(low.a, by_high.a));
    const __m512d e = _mm512_add_pd(_mm512_fmsub_pd(high.a, by_high.a, p), cross);
    const __m512d s = _mm512_sub_pd(sum.a, p), z = _mm512_sub_pd(s, sum.a);
    const __m512d rounded = _mm512_sub_pd(_mm512_sub_pd(sum.a, _mm512_sub_pd(s, z)), _mm512_add_pd(p, z));
    rest.a = _mm512_add_pd(rest.a, _mm512_sub_pd(rounded, e));
    sum.a = s;
  }
  [[gnu::always_inline]] static void add_exactly(Avx512& high, Avx512& low, const Avx512& x, const Avx512& y) {
    const __m512d p = _mm512_mul_pd(x.a, y.a), e = _mm512_fmsub_pd(x.a, y.a, p);
    const __m512d s = _mm512_add_pd(high.a, p), z = _mm512_sub_pd(s, high.a);
    const __m512d rounded = _mm512_add_pd(_mm512_sub_pd(high.a, _mm512_sub_pd(s, z)), _mm512_sub_pd(p, z));
    low.a = _mm512_add_pd(low.a, _mm512_add_pd(e, rounded));
    high.a = s;
  }
};

}  // namespace

void plain_avx512(const double* const* fixed, Count fixed_count, const double* moving, Count lags, Count count,
                  double* sums) {
  Count f = 0;
  for (; f + 4 <= fixed_count; f += 4) all_lags<Avx512, 4, 5>(fixed + f, moving, lags, count, sums + f * lags);
  switch (fixed_count - f) {
    case 3: return all_lags<Avx512, 3, 8>(fixed + f, moving, lags, count, sums + f * lags);
    case 2: return all_lags<Avx512, 2, 8>(fixed + f, moving, lags, count, sums + f * lags);
    case 1: return all_lags<Avx512, 1, 8>(fixed + f, moving, lags, count, sums + f * lags);
    default: return;
  }
}

void extended_avx512(const double* const* fixed, Count fixed_count, const double* moving, Count lags, Count count,
                     double* high, double* low) {
  for (Count f = 0; f < fixed_count; ++f)
    all_lags_extended<Avx512, 5>(fixed[f], moving, lags, count, high + f * lags, low + f * lags);
}

bool plain_cholesky_avx512(double* a, Count n, Count stride) { return plain_cholesky<Avx512, 8, 2>(a, n, stride); }

bool extended_cholesky_avx512(double* high, double* low, Count n, Count stride, double least_pivot) {
  return extended_cholesky<Avx512, 4>(high, low, n, stride, least_pivot);
}

DoublingEnd doubling_avx512(double* a, double* g, double* h, double* work, Count n, Count stride, int most,
                            double round_off) {
  return doubling<Avx512, 2>(a, g, h, work, n, stride, most, round_off);
}

}  // namespace wheelhop
