// Compiled with AVX-512 and -ffp-contract=off; called where the processor has it.
#include <immintrin.h>

#include "core/kernels/correlation_loops.hpp"
#include "core/kernels/correlation_sets.hpp"

namespace wheelhop {
namespace {

struct Avx512 {
  __m512d a;
  [[gnu::always_inline]] static Avx512 zero() { return {_mm512_setzero_pd()}; }
  [[gnu::always_inline]] static Avx512 load(const double* p) { return {_mm512_loadu_pd(p)}; }
  [[gnu::always_inline]] void store(double* p) const { _mm512_storeu_pd(p, a); }
  [[gnu::always_inline]] void add_product(const Avx512& x, const Avx512& y) { a = _mm512_fmadd_pd(x.a, y.a, a); }
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
  for (; f + 2 <= fixed_count; f += 2) all_lags<Avx512, 2, 8>(fixed + f, moving, lags, count, sums + f * lags);
  if (f < fixed_count) all_lags<Avx512, 1, 10>(fixed + f, moving, lags, count, sums + f * lags);
}

void extended_avx512(const double* const* fixed, Count fixed_count, const double* moving, Count lags, Count count,
                     double* high, double* low) {
  for (Count f = 0; f < fixed_count; ++f)
    all_lags_extended<Avx512, 5>(fixed[f], moving, lags, count, high + f * lags, low + f * lags);
}

}  // namespace wheelhop
