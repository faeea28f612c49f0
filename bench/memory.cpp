// Memory that a diagnosis takes by the number of its records, and a plan by the number of masses: the most at any time.
#include <fmt/format.h>
#include <malloc.h>

#include <cmath>
#include <fstream>
#include <string>

#include "bench/against.hpp"
#include "core/base/random.hpp"
#include "core/gap/plan/plan.hpp"
#include "core/plant/dataset.hpp"
#include "experiments/diagnose/diagnose.hpp"
#include "variants/table.hpp"

namespace wheelhop::bench {
namespace {

constexpr double kSamplingHz = 200;

/// Of /proc/self/status, in MB; 0 where there is none.
double status_mb(const std::string& key) {
  std::ifstream stream("/proc/self/status");
  for (std::string line; std::getline(stream, line);)
    if (line.starts_with(key + ":")) return std::stod(line.substr(key.size() + 1)) / 1024;
  return 0;
}

/// Runs the work, and counts the most memory that the process has had in it beyond what it had before.
template <class Work>
void count_peak(benchmark::State& state, Work&& work) {
  double peak_mb = 0;
  for (auto _ : state) {
    ::malloc_trim(0);
    std::ofstream("/proc/self/clear_refs") << 5;  // the peak begins anew
    const double before_mb = status_mb("VmRSS");
    work();
    peak_mb = status_mb("VmHWM") - before_mb;
  }
  state.counters["peak_mb"] = peak_mb;
}

Plant plant_of(const Json& file) { return parse_plant(JsonCursor::from(file, "plant.json")); }

/// Masses in a row on springs and dampers above a moving base, an accelerometer at either end.
Plant chain(int masses) {
  Json file = {{"name", "chain"},
               {"masses", Json::array()},
               {"inputs", {{{"name", "base"}, {"kind", "displacement"}, {"unit", "m"}, {"hold_hz", 1000}}}},
               {"elements", Json::array()},
               {"sensors", Json::array()}};
  for (int i = 0; i < masses; ++i) {
    const std::string name = fmt::format("m{}", i);
    file["masses"].push_back({{"name", name}, {"mass_kg", 1 + 0.1 * i}});
    file["elements"].push_back({{"name", fmt::format("e{}", i)},
                                {"between", {i == 0 ? "base" : fmt::format("m{}", i - 1), name}},
                                {"laws",
                                 {{{"law", "linear_spring"}, {"stiffness_n_per_m", 20000}},
                                  {{"law", "viscous_damper"}, {"damping_ns_per_m", 20}}}}});
  }
  for (const int i : {0, masses - 1})
    file["sensors"].push_back(
        {{"name", fmt::format("a{}", i)}, {"kind", "acceleration"}, {"of", fmt::format("m{}", i)}, {"unit", "m/s^2"}});
  return plant_of(file);
}

/// Noise through six poles at 10 Hz, 2 mm RMS.
Matrix smooth_drive(std::uint64_t number, Index samples) {
  Random random(31, Stream::road, number);
  Matrix drive(1, samples);
  Vector poles = Vector::Zero(6);
  for (double& value : drive.reshaped()) {
    value = random.normal();
    for (double& pole : poles) value = pole += 0.06 * (value - pole);
  }
  return drive * (0.002 * std::sqrt(static_cast<double>(samples)) / drive.norm());
}

/// Records of 8 s with 1 % noise, the last of them for validation.
RecordSet records_of(const Plant& plant, int count) {
  RecordSet set;
  set.sampling_hz = kSamplingHz;
  for (int i = 0; i <= count; ++i) {
    const auto number = static_cast<std::uint64_t>(i);
    GeneratedRecord made = generate_record(plant, smooth_drive(number, 8000), kSamplingHz);
    Random random(32, Stream::noise, number);
    for (Index s = 0; s < made.signal.y.rows(); ++s) {
      double& noise = set.noise_std[plant.sensors[static_cast<std::size_t>(s)].name];
      if (i == 0) noise = 0.01 * made.signal.y.row(s).norm() / std::sqrt(static_cast<double>(made.signal.y.cols()));
      made.signal.y.row(s) += noise * random.normal(1, made.signal.y.cols());
    }
    set.records.push_back({fmt::format("r{}.csv", i), i < count ? "estimation" : "validation", "", 0, made.signal});
  }
  return set;
}

void plan_chain(benchmark::State& state, int masses) {
  const Plant plant = chain(masses);
  FitRecord record;
  record.ratio = static_cast<Index>(plant.hold_hz() / kSamplingHz);
  record.drive = smooth_drive(0, 2000);
  record.weight_std = Vector::Constant(plant.sensor_count(), 0.01);
  Operation operation;
  std::vector<EffectCandidate> candidates;
  if (operation_of(plant, {record}, {}, operation)) candidates = effect_candidates(plant, operation);
  for (EffectCandidate& candidate : candidates) candidate = at_typical_size(std::move(candidate));
  count_peak(state, [&] {
    if (plan_test(plant, {record}, 1, candidates).status != Status::ok) state.SkipWithError("the plan failed");
  });
}

}  // namespace

void add_memory() {
  for (const int count : {10, 20, 40})
    add_work(
        "memory of a diagnosis", kOurs, fmt::format("records={}", count),
        [count](benchmark::State& state) {
          const Plant plant = chain(2);
          const RecordSet set = records_of(plant, count);
          count_peak(state, [&] {
            if (diagnose_records(plant, set, effect_candidates).status != Status::ok)
              state.SkipWithError("the diagnosis failed");
          });
        },
        1);
  for (const int masses : {8, 16, 32})
    add_work(
        "memory of a plan", kOurs, fmt::format("masses={}", masses),
        [masses](benchmark::State& state) { plan_chain(state, masses); }, 1);
}

}  // namespace wheelhop::bench
