#include "experiments/rig/records.hpp"

#include <cmath>
#include <cstdio>
#include <cstdlib>

namespace wheelhop::blind {
namespace {

/// Correlation of coloured noise from one sample to the next.
constexpr double noise_memory = 0.85;

enum class NoiseOf : std::uint64_t { est_1 = 1, est_2 = 2, val = 3 };

Observation seen_in(const Prepared& prepared, Realisation realisation, Index samples) {
  // Epochs keep what is not tied to the drive apart between records.
  const double epoch_s = 1000.0 * static_cast<double>(realisation);
  const ObserveOptions options{.samples = samples, .epoch_s = epoch_s};
  return observe(prepared.system, play(*prepared.spec.plan, commands_of(prepared.spec, realisation), options), options);
}

void add_noise(const Prepared& prepared, NoiseOf record, Matrix& y) {
  Random random(prepared.spec.seed, Stream::noise, prepared.spec.number, static_cast<std::uint64_t>(record));
  const double memory = prepared.spec.coloured ? noise_memory : 0, fresh = std::sqrt(1 - memory * memory);
  Vector noise = random.normal(y.rows(), 1);
  for (Index k = 0; k < y.cols(); ++k) {
    if (k > 0) noise = memory * noise + fresh * random.normal(y.rows(), 1);
    y.col(k) += prepared.noise_std.cwiseProduct(noise);
  }
}

/// Seven significant digits, as a logger writes them.
void shorten(Matrix& values) {
  char text[32];
  for (double& value : values.reshaped()) {
    std::snprintf(text, sizeof text, "%.7g", value);
    value = std::strtod(text, nullptr);
  }
}

Record record(const Prepared& prepared, std::string file, std::string role, std::string repeat_of, Matrix u, Matrix y) {
  convert(prepared.system, y);
  shorten(u);
  shorten(y);
  Record result{std::move(file), std::move(role), std::move(repeat_of), 0, {}};
  result.signal.u = std::move(u);
  result.signal.y = std::move(y);
  result.signal.sample_time_s = 1 / record_hz;
  result.signal.inputs = prepared.spec.plan->input_channels();
  result.signal.outputs = prepared.spec.plan->output_channels();
  return result;
}

}  // namespace

RecordSet measured_records(const Prepared& prepared) {
  RecordSet set;
  set.sampling_hz = record_hz;
  const auto add = [&](const Observation& seen, NoiseOf noise, const char* file, const char* role, const char* repeat) {
    Matrix y = seen.clean;
    add_noise(prepared, noise, y);
    set.records.push_back(record(prepared, file, role, repeat, seen.command, std::move(y)));
  };
  const Observation estimation = seen_in(prepared, Realisation::estimation, prepared.spec.samples);
  add(estimation, NoiseOf::est_1, "est_1.csv.gz", "estimation", "drive_1");
  add(estimation, NoiseOf::est_2, "est_2.csv.gz", "estimation", "drive_1");
  add(seen_in(prepared, Realisation::validation, prepared.spec.samples), NoiseOf::val, "val.csv.gz", "validation", "");
  return set;
}

RecordSet truth_records(const Prepared& prepared) {
  RecordSet set;
  set.sampling_hz = record_hz;
  const auto add = [&](Realisation realisation, Index samples, const char* file) {
    Observation seen = seen_in(prepared, realisation, samples);
    set.records.push_back(record(prepared, file, "validation", "", std::move(seen.command), std::move(seen.clean)));
  };
  add(Realisation::continuation, 4 * prepared.spec.samples, "val_long.csv.gz");
  add(Realisation::beyond, prepared.spec.samples, "beyond.csv.gz");
  return set;
}

}  // namespace wheelhop::blind
