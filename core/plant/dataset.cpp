#include "core/plant/dataset.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/data/resample.hpp"

namespace wheelhop {
namespace {

GeneratedRecord run(const Plant& plant, ConstMatrixRef drive, double sampling_hz, SimulateOptions options) {
  options.decimation = hold_samples_per_record_sample(plant, sampling_hz);
  Simulation simulation = simulate_measured(plant, drive, options);
  GeneratedRecord record;
  record.status = simulation.status;
  record.message = std::move(simulation.message);
  record.states = std::move(simulation.states);
  record.signal.y = std::move(simulation.outputs);
  record.signal.sample_time_s = 1 / sampling_hz;
  record.signal.inputs = plant.input_channels();
  record.signal.outputs = plant.output_channels();
  return record;
}

/// A drive behind the drive paths, as the plant feels it, and the way from ideal readings through the sensor paths.
struct Felt {
  Felt(const Plant& of, ConstMatrixRef command, SimulateOptions asked)
      : options(std::move(asked)), plant(of), ratio(options.decimation) {
    // A filter in a sensor reads what lies between the samples of the record.
    filtered = ratio > 1 && any_sensor_lags(plant);
    if (filtered) options.decimation = 1;
    drive = apply_drive_paths(plant, command, std::clamp<Index>(options.lead_samples, 0, command.cols()));
    options.sampled_drive = drive_at_samples(plant, drive);
  }

  Simulation measured(Simulation simulation) const {
    simulation.outputs = apply_sensor_paths(plant, simulation.outputs,
                                            plant.hold_hz() / static_cast<double>(options.decimation), options.stored);
    if (filtered) {
      simulation.outputs = decimate(simulation.outputs, ratio);
      simulation.states = decimate(simulation.states, ratio);
    }
    return simulation;
  }

  Matrix drive;
  SimulateOptions options;

 private:
  const Plant& plant;
  Index ratio;
  bool filtered = false;
};

}  // namespace

Index hold_samples_per_record_sample(const Plant& plant, double sampling_hz) {
  const double ratio = plant.hold_hz() / sampling_hz;
  const double whole = std::round(ratio);
  // 1 / (1 / f) is not f: rates that went through a sample time agree to round-off only.
  if (!(whole >= 1) || std::abs(ratio - whole) > 1e-9 * whole)
    throw UserError(
        fmt::format("plant \"{}\": expected a hold rate that is a whole multiple of the sampling rate of {} "
                    "Hz, found hold_hz = {}",
                    plant.name, sampling_hz, plant.hold_hz()));
  return static_cast<Index>(whole);
}

Simulation simulate_measured(const Plant& plant, ConstMatrixRef drive, SimulateOptions options) {
  const Felt felt(plant, drive, std::move(options));
  return felt.measured(simulate(plant, felt.drive, felt.options));
}

std::vector<Simulation> simulate_measured_side_by_side(const std::vector<SimulationTask>& tasks) {
  std::vector<Felt> felt;
  std::vector<SimulationTask> inner;
  felt.reserve(tasks.size());
  for (const SimulationTask& task : tasks) {
    const Felt& own = felt.emplace_back(*task.plant, *task.drive, task.options);
    inner.push_back({task.plant, &own.drive, own.options});
  }
  std::vector<Simulation> results = simulate_side_by_side(inner);
  for (std::size_t i = 0; i < results.size(); ++i) results[i] = felt[i].measured(std::move(results[i]));
  return results;
}

VariedSimulation simulate_varied(const Plant& plant, ConstMatrixRef drive, SimulateOptions options,
                                 std::vector<Variation> variations) {
  const Index ratio = options.decimation;
  bool filtered = ratio > 1 && any_sensor_lags(plant);
  for (const Variation& variation : variations)
    filtered = filtered || (ratio > 1 && variation.neighbour && any_sensor_lags(*variation.neighbour));
  if (filtered) {
    options.decimation = 1;
    for (Variation& variation : variations) variation.kept_samples *= variation.kept_samples > 0 ? ratio : 1;
  }
  const Index first = std::clamp<Index>(options.lead_samples, 0, drive.cols());
  const Matrix felt = apply_drive_paths(plant, drive, first);
  options.sampled_drive = drive_at_samples(plant, felt);
  const bool apart = options.sampled_drive.size() > 0;
  bool any_apart = false;
  for (Variation& variation : variations) {
    if (!variation.neighbour || same_drive_paths(plant, *variation.neighbour)) continue;
    const Matrix there = apply_drive_paths(*variation.neighbour, drive, first);
    const Matrix sampled = drive_at_samples(*variation.neighbour, there);
    variation.drive = (there - felt) / variation.step;
    if (!apart && sampled.size() == 0) continue;
    any_apart = true;
    variation.sampled =
        ((sampled.size() > 0 ? sampled : there) - (apart ? options.sampled_drive : felt)) / variation.step;
  }
  if (any_apart && !apart) options.sampled_drive = felt;
  Tangent tangent(plant, variations, (drive.cols() - options.lead_samples - 1) / options.decimation + 1);
  VariedSimulation varied;
  Simulation& simulation = varied.simulation;
  simulation = simulate(plant, felt, options, &tangent);
  varied.outputs = std::move(tangent.outputs);
  varied.defined = std::move(tangent.defined);
  if (simulation.status != Status::ok) return varied;
  const double rate_hz = plant.hold_hz() / static_cast<double>(options.decimation);
  const Matrix ideal = std::move(simulation.outputs);
  simulation.outputs = apply_sensor_paths(plant, ideal, rate_hz, options.stored);
  for (std::size_t c = 0; c < variations.size(); ++c) {
    const double step = variations[c].step;
    const Plant& there = variations[c].neighbour ? *variations[c].neighbour : plant;
    Matrix& change = varied.outputs[c];
    Vector stored = options.stored;
    if (variations[c].stored.size() > 0 && stored.size() > 0) stored += step * variations[c].stored;
    change = (apply_sensor_paths(there, ideal + step * change, rate_hz, stored) - simulation.outputs) / step;
    if (filtered) change = decimate(change, ratio);
  }
  if (filtered) {
    simulation.outputs = decimate(simulation.outputs, ratio);
    simulation.states = decimate(simulation.states, ratio);
  }
  return varied;
}

GeneratedRecord generate_record(const Plant& plant, ConstMatrixRef drive, double sampling_hz, SimulateOptions options) {
  GeneratedRecord record = run(plant, drive, sampling_hz, options);
  const Index ratio = hold_samples_per_record_sample(plant, sampling_hz);
  record.signal.u =
      decimate(drive.rightCols(drive.cols() - options.lead_samples), ratio).leftCols(record.signal.y.cols());
  return record;
}

Matrix drive_of_record(const Plant& plant, const Signal& record) {
  Matrix drive(plant.input_count(), record.samples());
  for (Index i = 0; i < plant.input_count(); ++i) {
    const PlantInput& input = plant.inputs[static_cast<std::size_t>(i)];
    std::string known;
    Index row = -1;
    for (std::size_t k = 0; k < record.inputs.size(); ++k) {
      known += (k ? ", " : "") + record.inputs[k].name;
      if (record.inputs[k].name == input.name) row = static_cast<Index>(k);
    }
    if (row < 0)
      throw UserError(fmt::format("plant \"{}\": expected an input channel \"{}\" in the record, found: {}", plant.name,
                                  input.name, known));
    const std::string& unit = record.inputs[static_cast<std::size_t>(row)].unit;
    if (!unit.empty() && unit != input.unit)
      throw UserError(fmt::format("plant \"{}\": expected input \"{}\" in {}, found it in {} in the record", plant.name,
                                  input.name, input.unit, unit));
    drive.row(i) = record.u.row(row);
    if (input.kind != InputKind::schedule || drive.cols() == 0) continue;
    const double slack = kBeyondSchedule * (input.range.high - input.range.low);
    const double low = drive.row(i).minCoeff(), high = drive.row(i).maxCoeff();
    if (low < input.range.low - slack || high > input.range.high + slack)
      throw UserError(
          fmt::format("plant \"{}\": expected \"{}\" to stay in its range of {:.4g} to {:.4g} {}, found {:.4g} "
                      "to {:.4g} in the record",
                      plant.name, input.name, input.range.low, input.range.high, input.unit, low, high));
  }
  return drive;
}

GeneratedRecord simulate_record(const Plant& plant, const Signal& record, SimulateOptions options) {
  const Matrix slow = drive_of_record(plant, record);
  if (slow.cols() == 0) throw UserError(fmt::format("plant \"{}\": expected a record with samples", plant.name));
  const Index ratio = hold_samples_per_record_sample(plant, 1 / record.sample_time_s);
  Matrix drive(slow.rows(), options.lead_samples + slow.cols() * ratio);
  for (Index i = 0; i < slow.rows(); ++i) {
    const Interpolation kind = interpolation_from(plant.inputs[static_cast<std::size_t>(i)].interpolation);
    drive.row(i).head(options.lead_samples).setConstant(slow(i, 0));
    drive.row(i).tail(slow.cols() * ratio) = interpolate(slow.row(i), ratio, kind);
  }
  GeneratedRecord result = run(plant, drive, 1 / record.sample_time_s, options);
  result.signal.u = slow.leftCols(result.signal.y.cols());
  result.signal.sample_time_s = record.sample_time_s;
  result.signal.skip = record.skip;
  return result;
}

}  // namespace wheelhop
