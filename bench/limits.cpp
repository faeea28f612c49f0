#include "bench/limits.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <vector>

#include "core/base/linalg.hpp"

namespace wheelhop::bench {
namespace {

template <class Work>
double least_seconds(int repetitions, Work&& work) {
  double least = 1e9;
  for (int r = 0; r < repetitions; ++r) {
    const auto start = std::chrono::steady_clock::now();
    work();
    least = std::min(least, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  return least;
}

/// Twelve independent chains of `Lanes`, so that the latency of none is waited for. The repetitions are written out
/// because a lambda given to least_seconds() would not be compiled for the instruction set of the caller.
template <class Lanes>
[[gnu::always_inline]] inline double chains_gflops() {
  constexpr int kChains = 12, kSteps = 2000000;
  constexpr int kLanes = sizeof(Lanes) / sizeof(double);
  Lanes chains[kChains];
  for (Lanes& chain : chains) chain = Lanes{} + 1;
  Lanes factor = Lanes{} + 0.999999, term = Lanes{} + 1e-6;
  asm volatile("" : "+m"(factor), "+m"(term));
  double seconds = 1e9;
  for (int repetition = 0; repetition < 5; ++repetition) {
    const auto start = std::chrono::steady_clock::now();
    for (int k = 0; k < kSteps; ++k)
#pragma GCC unroll 12
      for (Lanes& chain : chains) chain = chain * factor + term;
    asm volatile("" ::"r"(chains) : "memory");
    seconds = std::min(seconds, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  return 2.0 * kLanes * kChains * kSteps / seconds * 1e-9;
}

using FourLanes = double __attribute__((vector_size(32)));
#ifdef __x86_64__
using EightLanes = double __attribute__((vector_size(64)));
[[gnu::target("avx512f,fma")]] double gflops_avx512() { return chains_gflops<EightLanes>(); }
#endif

}  // namespace

double peak_gflops() {
#ifdef __x86_64__
  if (__builtin_cpu_supports("avx512f")) return gflops_avx512();
#endif
  return chains_gflops<FourLanes>();
}

double triad_gb_per_s() {
  const std::size_t count = 8000000;
  std::vector<double> a(count, 0), b(count, 1), c(count, 2);
  const double seconds = least_seconds(5, [&] {
    for (std::size_t i = 0; i < count; ++i) a[i] = b[i] + 3 * c[i];
    asm volatile("" ::"r"(a.data()) : "memory");
  });
  return 3.0 * sizeof(double) * static_cast<double>(count) / seconds * 1e-9;
}

}  // namespace wheelhop::bench
