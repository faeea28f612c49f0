/// \file
/// Benchmarks beside peers.
#pragma once

#include <benchmark/benchmark.h>

#include <string>

#include "bench/report.hpp"

namespace wheelhop::bench {

/// Registers "WHAT|VARIANT|CASE". @param work of a benchmark::State
template <class Work>
void add_work(const std::string& what, const std::string& variant, const std::string& of, Work work,
              int repetitions = 9) {
  benchmark::RegisterBenchmark((what + "|" + variant + "|" + of).c_str(),
                               [work](benchmark::State& state) { work(state); })
      ->Repetitions(repetitions)
      ->MinTime(0.02)
      ->Unit(benchmark::kMillisecond);
}

/// Registers the kernels and the whole linear identification beside SLICOT and LAPACK. Without their libraries: ours
/// alone is not compared, and nothing is registered.
void add_peers();

/// Registers the training of a small network beside Ceres, where this is installed.
void add_training();

/// Registers whole diagnoses and plans of growing size, and the memory that each takes at its peak.
void add_memory();

/// Registers the stepping of a quarter car: one simulation, four side by side, and one with its sensitivities.
void add_stepping();

}  // namespace wheelhop::bench
