// `wheelhop bench`: the kernels and their peers in one process, repetitions interleaved.
#include <fmt/format.h>

#include <cstring>
#include <fstream>

#include "bench/against.hpp"
#include "bench/limits.hpp"
#include "bench/report.hpp"
#include "core/base/files.hpp"
#include "core/base/status.hpp"
#include "experiments/run/memory.hpp"
#include "experiments/run/provenance.hpp"
#ifdef WHEELHOP_HAS_PEERS
#include "bench/peers.hpp"
#endif

namespace {

using namespace wheelhop;

std::string processor() {
  std::ifstream stream("/proc/cpuinfo");
  for (std::string line; std::getline(stream, line);)
    if (line.starts_with("model name")) return line.substr(line.find(':') + 2);
  return "unknown";
}

const char* const kHelp =
    "Times the kernels beside SLICOT, LAPACK and Ceres (Debian: libslicot-dev, libopenblas-serial-dev, libceres-dev)\n"
    "in one process, one thread.\n"
    "Usage: wheelhop bench [--out FILE.json] [options of Google Benchmark]\n"
    "  --benchmark_filter=Riccati    only what the expression matches\n"
    "  --benchmark_list_tests        names, as WHAT|VARIANT|CASE\n"
    "Ratios are a peer's median time over ours: above 1 we are ahead.\n";

}  // namespace

int main(int argc, char** argv) {
  keep_freed_memory();  // as the program does, for the peers too
  std::string out;
  std::vector<char*> passed = {argv[0]};
  std::string interleaved = "--benchmark_enable_random_interleaving=true";
  // Every repetition first runs untimed: what others did between two of them took its data out of the caches.
  std::string warm = "--benchmark_min_warmup_time=0.1";
  passed.push_back(interleaved.data());
  passed.push_back(warm.data());
  for (int i = 1; i < argc; ++i) {
    if (std::strcmp(argv[i], "--help") == 0) {
      fmt::print("{}", kHelp);
      return 0;
    }
    if (std::strcmp(argv[i], "--out") == 0 && i + 1 < argc)
      out = argv[++i];
    else
      passed.push_back(argv[i]);
  }
  bench::add_peers();
  bench::add_training();
  bench::add_stepping();
  bench::add_memory();
  int count = static_cast<int>(passed.size());
  benchmark::Initialize(&count, passed.data());
  if (benchmark::ReportUnrecognizedArguments(count, passed.data())) return 2;
  bench::RatioReporter reporter;
  if (benchmark::RunSpecifiedBenchmarks(&reporter) == 0) return 2;
  const Json results = reporter.finish(), complexity = reporter.complexity();
  const Json limits = {{"fma_gflops", bench::peak_gflops()}, {"triad_gb_per_s", bench::triad_gb_per_s()}};
  fmt::print("one core of {}: {:.3g} GFLOP/s in fused multiply-adds, {:.3g} GB/s in the triad\n", processor(),
             limits["fma_gflops"].get<double>(), limits["triad_gb_per_s"].get<double>());
  if (out.empty()) return 0;
  Json file = {{"schema", "wheelhop.bench/1"},
               {"processor", processor()},
               {"limits", limits},
               {"results", results},
               {"complexity", complexity}};
#ifdef WHEELHOP_HAS_PEERS
  file["blas"] = peers::blas_in_use();
#endif
  file["provenance"] = provenance();
  try {
    write_json(out, file);
  } catch (const UserError& error) {
    fmt::print(stderr, "wheelhop: {}\n", error.what());
    return 2;
  }
  fmt::print("written: {}\n", out);
  return 0;
}
