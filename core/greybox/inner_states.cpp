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
  const Simulation rest =
      simulate_measured(before_couplings(plant), record.drive.leftCols(record.ratio), run_options(plant, record));
  if (rest.status != Status::ok) return state;
  auto next = names.begin() + static_cast<std::ptrdiff_t>(of_laws);
  for (Index i = 0; i < plant.sensor_count(); ++i) {
    if (!(plant.sensors[static_cast<std::size_t>(i)].path.high_pass_hz > 0)) continue;
    if (!listed(*next)) state.memories.emplace_back(*next, rest.outputs(i, 0));
    ++next;
  }
  return state;
}

Vector typical_inner_states(const Plant& plant, const std::vector<FitRecord>& records,
                            const std::vector<InitialState>& initial_states, const std::vector<InitialState>& rest) {
  const auto count = static_cast<Index>(inner_state_names(plant).size());
  const auto of_laws = static_cast<Index>(memory_names(plant).size());
  const Plant uncoupled = count > of_laws ? before_couplings(plant) : plant;
  Vector scale = Vector::Zero(count);
  for (std::size_t i = 0; i < records.size() && count > 0; ++i) {
    const Simulation run =
        simulate_measured(uncoupled, records[i].drive, run_options(plant, records[i], initial_states[i]));
    if (run.status != Status::ok) return {};
    Vector own(count);
    if (of_laws > 0) own.head(of_laws) = rms(run.states.bottomRows(of_laws));
    const Vector stored_at_rest = stored_by_sensors(plant, rest[i]);
    for (Index sensor = 0, next = of_laws; next < count; ++sensor) {
      const double corner_hz = plant.sensors[static_cast<std::size_t>(sensor)].path.high_pass_hz;
      if (!(corner_hz > 0)) continue;
      const Vector stored = apply_lag({.time_constant_s = 1 / (2 * std::numbers::pi * corner_hz)},
                                      run.outputs.row(sensor).array().transpose() - stored_at_rest(sensor),
                                      plant.hold_hz() / static_cast<double>(records[i].ratio));
      own(next++) = std::sqrt(stored.squaredNorm() / static_cast<double>(stored.size()));
    }
    scale = scale.cwiseMax(own);
  }
  return scale.cwiseMax(kLeastMemory);
}

}  // namespace wheelhop
