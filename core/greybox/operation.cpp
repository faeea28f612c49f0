#include "core/greybox/operation.hpp"

#include <algorithm>
#include <cmath>

#include "core/data/resample.hpp"
#include "core/plant/dataset.hpp"

namespace wheelhop {
namespace {

/// Running range and moments of one quantity.
struct Range1 {
  double low = std::numeric_limits<double>::infinity(), high = -low, sum = 0, square = 0;
  double count = 0;
  void add(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
    sum += value;
    square += value * value;
    ++count;
  }
  double spread() const { return std::sqrt(std::max(square / count - sum * sum / (count * count), 0.0)); }
};

struct ElementRanges {
  Range1 travel, rate, force;
};

bool visit_record(const Plant& plant, const FitRecord& record, const Vector& initial_state,
                  std::vector<ElementRanges>& ranges, Vector& output_rms) {
  const Simulation run = simulate_measured(plant, record.drive, run_options(plant, record, initial_state));
  if (run.status != Status::ok) return false;
  for (Index j = 0; j < output_rms.size(); ++j)
    output_rms(j) =
        std::max(output_rms(j), std::sqrt((run.outputs.row(j).array() - run.outputs.row(j).mean()).square().mean()));
  const Matrix felt = decimate(apply_drive_paths(plant, record.drive, 0), record.ratio);
  const Index n = plant.mass_count();
  const double sample_s = static_cast<double>(record.ratio) / plant.hold_hz();
  Motion motion(plant);
  Vector a(n), z_rate(motion.memories()), u_rate = Vector::Zero(plant.input_count());
  std::vector<double> before(ranges.size());
  for (Index k = 0; k < run.states.cols(); ++k) {
    const double* const q = run.states.col(k).data();
    if (k > 0) u_rate = (felt.col(k) - felt.col(k - 1)) / sample_s;
    motion.set_inputs(felt.col(k).data(), u_rate.data());
    if (motion.accelerations(q, q + n, q + 2 * n, a.data(), z_rate.data()) != Motion::all_defined) return false;
    for (std::size_t e = 0; e < ranges.size(); ++e) {
      const double travel = motion.travel(static_cast<int>(e));
      ranges[e].travel.add(travel);
      ranges[e].force.add(motion.element_force(static_cast<Index>(e)));
      if (k > 0) ranges[e].rate.add((travel - before[e]) / sample_s);
      before[e] = travel;
    }
  }
  return true;
}

}  // namespace

bool operation_of(const Plant& plant, const std::vector<FitRecord>& records, const std::vector<Vector>& initial_states,
                  Operation& operation) {
  const Index p = plant.sensor_count();
  std::vector<ElementRanges> ranges(plant.elements.size());
  operation = {};
  operation.drive_peak = operation.drive_rate_peak = Vector::Zero(plant.input_count());
  operation.output_rms = operation.output_quantum = Vector::Zero(p);
  for (std::size_t i = 0; i < records.size(); ++i) {
    const FitRecord& record = records[i];
    const Vector start = initial_states.empty() ? Vector() : initial_states[i];
    if (!visit_record(plant, record, start, ranges, operation.output_rms)) return false;
    const Index N = record.drive.cols();
    operation.drive_peak = operation.drive_peak.cwiseMax(record.drive.cwiseAbs().rowwise().maxCoeff());
    operation.drive_rate_peak = operation.drive_rate_peak.cwiseMax(
        plant.hold_hz() *
        (record.drive.rightCols(N - 1) - record.drive.leftCols(N - 1)).cwiseAbs().rowwise().maxCoeff());
    if (record.quantum.size() == p) operation.output_quantum = operation.output_quantum.cwiseMax(record.quantum);
  }
  for (const ElementRanges& own : ranges)
    operation.elements.push_back({own.travel.low, own.travel.high, own.travel.spread(),
                                  std::hypot(own.rate.spread(), own.rate.sum / own.rate.count), own.force.high,
                                  own.force.spread()});
  return true;
}

}  // namespace wheelhop
