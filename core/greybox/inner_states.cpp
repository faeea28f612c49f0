#include "core/greybox/inner_states.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/data/metrics.hpp"
#include "core/plant/dataset.hpp"

namespace wheelhop {
namespace {

// Least scale of an inner state, in its unit. It only keeps the scale of one that never moves above zero.
constexpr double kLeastMemory = 1e-12;

/// The plant whose sensors read what goes into their AC couplings.
Plant before_couplings(Plant plant) {
  for (Sensor& sensor : plant.sensors) {
    SensorPath path;
    path.gain = sensor.path.gain;
    path.crosstalk = sensor.path.crosstalk;
    path.delay_s = sensor.path.delay_s;
    path.lag = sensor.path.lag;
    sensor.path = path;
  }
  return plant;
}

}  // namespace

InitialState with_stored(const Plant& plant, const FitRecord& record, InitialState state) {
  const auto of_laws = memory_names(plant).size();
  const std::vector<std::string> names = inner_state_names(plant);
  const auto listed = [&](const std::string& name) {
    return std::any_of(state.memories.begin(), state.memories.end(),
                       [&](const auto& memory) { return memory.first == name; });
  };
  if (std::all_of(names.begin() + static_cast<std::ptrdiff_t>(of_laws), names.end(), listed)) return state;
  const Matrix held = record.drive.col(0).replicate(1, record.ratio);
  const Simulation rest = simulate_measured(before_couplings(plant), held, run_options(plant, record));
  auto next = names.begin() + static_cast<std::ptrdiff_t>(of_laws);
  for (Index i = 0; i < plant.sensor_count(); ++i) {
    if (!(plant.sensors[static_cast<std::size_t>(i)].path.high_pass_hz > 0)) continue;
    if (!listed(*next)) state.memories.emplace_back(*next, rest.status == Status::ok ? rest.outputs(i, 0) : 0);
    ++next;
  }
  return state;
}

Vector typical_inner_states(const Plant& plant, const std::vector<FitRecord>& records,
                            const std::vector<InitialState>& initial_states) {
  const auto count = static_cast<Index>(inner_state_names(plant).size());
  const auto of_laws = static_cast<Index>(memory_names(plant).size());
  Vector scale = Vector::Zero(count);
  for (std::size_t i = 0; i < records.size() && of_laws > 0; ++i) {
    const Simulation run =
        simulate_measured(plant, records[i].drive, run_options(plant, records[i], initial_states[i]));
    if (run.status != Status::ok) return {};
    scale.head(of_laws) = scale.head(of_laws).cwiseMax(rms(run.states.bottomRows(of_laws)));
  }
  for (const FitRecord& record : records)
    for (Index sensor = 0, next = of_laws; next < count; ++sensor) {
      const double corner_hz = plant.sensors[static_cast<std::size_t>(sensor)].path.high_pass_hz;
      if (!(corner_hz > 0)) continue;
      const double rate_hz = plant.hold_hz() / static_cast<double>(record.ratio);
      double stored = 0, power = 0;
      for (const double reading : record.y.row(sensor)) {
        stored += 2 * std::numbers::pi * corner_hz / rate_hz * reading;
        power += stored * stored;
      }
      scale(next) = std::max(scale(next), std::sqrt(power / static_cast<double>(record.y.cols())));
      ++next;
    }
  return scale.cwiseMax(kLeastMemory);
}

}  // namespace wheelhop
