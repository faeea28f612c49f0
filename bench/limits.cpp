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

}  // namespace

double peak_gflops() {
  // Twelve independent chains of four lanes: the latency of none is waited for.
  using Lanes = Eigen::Array<double, 4, 1>;
  constexpr int kChains = 12, kSteps = 2000000;
  Lanes chains[kChains];
  for (Lanes& chain : chains) chain.setConstant(1);
  Lanes factor = Lanes::Constant(0.999999), term = Lanes::Constant(1e-6);
  asm volatile("" : "+m"(factor), "+m"(term));
  const double seconds = least_seconds(5, [&] {
    for (int k = 0; k < kSteps; ++k)
#pragma GCC unroll 12
      for (Lanes& chain : chains) chain = chain * factor + term;
    asm volatile("" ::"r"(chains) : "memory");
  });
  return 2.0 * 4 * kChains * kSteps / seconds * 1e-9;
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
