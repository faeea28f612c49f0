#include "core/greybox/operation.hpp"

#include <algorithm>
#include <cmath>

#include "core/data/resample.hpp"
#include "core/plant/dataset.hpp"

namespace wheelhop {
namespace {

constexpr double kSameReading = 1e-9;  // of its size, in which the mean of repeats differs by rounding
constexpr Index kCeiling = 5;          // readings of just the largest size; where nothing holds them there is one

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
  ElementOperation operation() const {
    return {travel.low, travel.high,   travel.spread(), std::hypot(rate.spread(), rate.sum / rate.count),
            force.high, force.spread()};
  }
};

/// Readings of the largest size, and how many there are.
struct Extreme {
  double size = 0;
  Index count = 0;
  void add(double value) {
    const double own = std::abs(value);
    if (own > size * (1 + kSameReading)) {
      size = own;
      count = 1;
    } else if (own >= size * (1 - kSameReading)) {
      ++count;
    }
  }
};

/// What the records of a plant have shown so far.
struct Seen {
  std::vector<ElementRanges> elements, guides;
  Vector output_rms, output_peak, output_rate_peak;
};

bool visit_record(const Plant& plant, const FitRecord& record, const InitialState& initial_state, Seen& seen) {
  const Simulation run = simulate_measured(plant, record.drive, run_options(plant, record, initial_state));
  if (run.status != Status::ok) return false;
  const double sample_s = static_cast<double>(record.ratio) / plant.hold_hz();
  const Matrix& y = run.outputs;
  for (Index j = 0; j < y.rows(); ++j)
    seen.output_rms(j) = std::max(seen.output_rms(j), std::sqrt((y.row(j).array() - y.row(j).mean()).square().mean()));
  seen.output_peak = seen.output_peak.cwiseMax(y.cwiseAbs().rowwise().maxCoeff());
  if (const Index steps = y.cols() - 1; steps > 0)
    seen.output_rate_peak = seen.output_rate_peak.cwiseMax(
        (y.rightCols(steps) - y.leftCols(steps)).cwiseAbs().rowwise().maxCoeff() / sample_s);
  const Matrix felt = decimate(apply_drive_paths(plant, record.drive, 0), record.ratio);
  const Index n = plant.mass_count();
  Motion motion(plant);
  Vector a(n), z_rate(motion.memories()), u_rate = Vector::Zero(plant.input_count());
  std::vector<double> before(seen.elements.size());
  for (Index k = 0; k < run.states.cols(); ++k) {
    const double* const q = run.states.col(k).data();
    if (k > 0) u_rate = (felt.col(k) - felt.col(k - 1)) / sample_s;
    motion.set_inputs(felt.col(k).data(), u_rate.data());
    if (motion.accelerations(q, q + n, q + 2 * n, a.data(), z_rate.data()) != Motion::all_defined) return false;
    for (std::size_t e = 0; e < seen.elements.size(); ++e) {
      const double travel = motion.travel(static_cast<int>(e));
      seen.elements[e].travel.add(travel);
      seen.elements[e].force.add(motion.element_force(static_cast<Index>(e)));
      if (k > 0) seen.elements[e].rate.add((travel - before[e]) / sample_s);
      before[e] = travel;
    }
    for (Index i = 0; i < n; ++i) {
      ElementRanges& guide = seen.guides[static_cast<std::size_t>(i)];
      guide.travel.add(q[i]);
      guide.rate.add(q[n + i]);
      guide.force.add(-motion.mass_kg(i) * a(i));
    }
  }
  return true;
}

}  // namespace

bool operation_of(const Plant& plant, const std::vector<FitRecord>& records,
                  const std::vector<InitialState>& initial_states, Operation& operation) {
  const Index p = plant.sensor_count();
  Seen seen;
  seen.elements.resize(plant.elements.size());
  seen.guides.resize(plant.masses.size());
  seen.output_rms = seen.output_peak = seen.output_rate_peak = Vector::Zero(p);
  std::vector<Extreme> readings(static_cast<std::size_t>(p));
  operation = {};
  operation.drive_peak = operation.drive_rate_peak = Vector::Zero(plant.input_count());
  operation.output_ceiling = operation.output_quantum = Vector::Zero(p);
  for (std::size_t i = 0; i < records.size(); ++i) {
    const FitRecord& record = records[i];
    const InitialState start = initial_states.empty() ? InitialState() : initial_states[i];
    if (!visit_record(plant, record, start, seen)) return false;
    const Index N = record.drive.cols();
    operation.drive_peak = operation.drive_peak.cwiseMax(record.drive.cwiseAbs().rowwise().maxCoeff());
    operation.drive_rate_peak = operation.drive_rate_peak.cwiseMax(
        plant.hold_hz() *
        (record.drive.rightCols(N - 1) - record.drive.leftCols(N - 1)).cwiseAbs().rowwise().maxCoeff());
    if (record.quantum.size() == p) operation.output_quantum = operation.output_quantum.cwiseMax(record.quantum);
    if (record.y.rows() != p) continue;  // a test that is only planned
    for (Index j = 0; j < p; ++j)
      for (Index k = 0; k < record.y.cols(); ++k) readings[static_cast<std::size_t>(j)].add(record.y(j, k));
  }
  for (const ElementRanges& own : seen.elements) operation.elements.push_back(own.operation());
  for (const ElementRanges& own : seen.guides) operation.guides.push_back(own.operation());
  operation.output_rms = seen.output_rms;
  operation.output_peak = seen.output_peak;
  operation.output_rate_peak = seen.output_rate_peak;
  for (Index j = 0; j < p; ++j)
    if (const Extreme& own = readings[static_cast<std::size_t>(j)]; own.count >= kCeiling)
      operation.output_ceiling(j) = own.size;
  return true;
}

}  // namespace wheelhop
