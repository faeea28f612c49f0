/// \file
/// Results of a bench run as ratios: every case of "WHAT|VARIANT|CASE" against the variant "wheelhop" of the same WHAT
/// and CASE, medians over interleaved repetitions.
#pragma once

#include <benchmark/benchmark.h>

#include <map>
#include <string>
#include <vector>

#include "core/base/json.hpp"

namespace wheelhop::bench {

inline constexpr const char* kOurs = "wheelhop";

class RatioReporter : public benchmark::BenchmarkReporter {
 public:
  bool ReportContext(const Context&) override { return true; }
  void ReportRuns(const std::vector<Run>& runs) override;
  void Finalize() override {}

  /// Peer's median over ours; above 1 we are ahead. Prints a table. @return `[{"what", "case", "variant", "ms":
  /// {"median", "q05", "q95"}, "repetitions", counters ..., "ratio"}]`
  Json finish();

  /// How the time, and the counter "peak_mb" where there is one, grows with the first size of a case ("N=20k s=20" with
  /// N, "n=010" with n): the least-squares slope of log(median) over log(size), where there are three sizes at least.
  /// Prints a table.
  /// @return `[{"quantity": "time" or "peak_mb", "what", "variant", "case", "sizes": [least, largest], "exponent"}]`
  Json complexity() const;

 private:
  struct Measured {
    std::vector<double> ms;
    std::map<std::string, double> counters;
    std::string error;
  };
  double median_of(const std::string& name) const;
  std::vector<std::string> order_;
  std::map<std::string, Measured> measured_;
};

}  // namespace wheelhop::bench
