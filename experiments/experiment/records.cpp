#include "experiments/experiment/records.hpp"

#include <cmath>
#include <limits>

#include "core/data/noise.hpp"
#include "core/plant/dataset.hpp"
#include "core/plant/motion.hpp"

namespace wheelhop {
namespace {

/// The same numbers as `generate` draws for a config whose records are these two.
GeneratedRecord make_record(const ExperimentConfig& config, const Plant& plant, Index which, double seconds,
                            Index realisation) {
  const double hold_hz = plant.hold_hz();
  const Index lead = std::llround(config.data.settle_s * hold_hz);
  const Index samples =
      std::llround(seconds * config.data.sampling_hz) * hold_samples_per_record_sample(plant, config.data.sampling_hz);
  Matrix drive(plant.input_count(), lead + samples);
  for (Index i = 0; i < plant.input_count(); ++i) {
    Random random(static_cast<std::uint64_t>(config.data.seed), Stream::road,
                  static_cast<std::uint64_t>(which * 4096 + i), static_cast<std::uint64_t>(realisation));
    drive.row(i) = make_drive(config.drive, hold_hz, lead, samples, random).values;
  }
  return generate_record(unconverted(plant), drive, config.data.sampling_hz,
                         {.substeps = config.data.substeps, .lead_samples = lead, .from_equilibrium = true});
}

/// Every parameter normal about its value within its tolerance, drawn again where it leaves its range.
Plant drawn_plant(const ExperimentConfig& config, Index realisation) {
  Plant plant = config.plant;
  Random random(static_cast<std::uint64_t>(config.data.seed), Stream::parameters, 0,
                static_cast<std::uint64_t>(realisation));
  for (const PlantParameter& parameter : plant_parameters(config.plant)) {
    double value;
    do value = parameter.value * (1 + parameter.tolerance * random.normal());
    while (value < parameter.range.low || value > parameter.range.high);
    set_parameter(plant, parameter.name, value);
  }
  return plant;
}

void keep_outputs(const ExperimentConfig& config, Signal& signal) {
  if (static_cast<Index>(config.outputs.size()) == signal.output_count()) return;
  signal.y = Matrix(signal.y(config.outputs, Eigen::all));
  std::vector<Channel> kept;
  for (const Index row : config.outputs) kept.push_back(signal.outputs[static_cast<std::size_t>(row)]);
  signal.outputs = std::move(kept);
}

/// What is left of the rows of `signal` (r x N) after regression on a constant and the rows of `regressors`.
Matrix nonlinear_part(ConstMatrixRef signal, ConstMatrixRef regressors) {
  Matrix columns(signal.cols(), regressors.rows() + 1);
  columns << Vector::Ones(signal.cols()), regressors.transpose();
  const Matrix target = signal.transpose();
  return target - columns * least_squares(columns, target).x;
}

}  // namespace

SimulatedRecords simulate_records(const ExperimentConfig& config, Index realisation) {
  SimulatedRecords records;
  records.plant = config.departures.draw_parameters ? drawn_plant(config, realisation) : config.plant;
  const char* names[] = {"training", "validation"};
  const double seconds[] = {config.data.estimation_s, config.data.validation_s};
  for (Index which = 0; which < 2; ++which) {
    GeneratedRecord record = make_record(config, records.plant, which, seconds[which], realisation);
    records.status = record.status;
    if (record.status != Status::ok) {
      records.message = std::string(names[which]) + " record: " + record.message;
      return records;
    }
    Signal& signal = which == 0 ? records.training : records.validation;
    signal = std::move(record.signal);
    (which == 0 ? records.training_states : records.validation_states) = std::move(record.states);
    if (which == 1) {
      records.clean = signal.y;
      convert_readings(unquantised(records.plant), records.clean);  // what the range holds, without noise and rounding
    }
    records.noise_std = Vector::Zero(signal.output_count());
    if (config.data.snr_db) {
      Random random(static_cast<std::uint64_t>(config.data.seed), Stream::noise, static_cast<std::uint64_t>(which),
                    static_cast<std::uint64_t>(realisation));
      records.noise_std = add_noise(signal, *config.data.snr_db, random, config.departures.noise_corner_hz);
    }
    convert_readings(records.plant, signal.y);
    keep_outputs(config, signal);
  }
  records.clean = Matrix(records.clean(config.outputs, Eigen::all));
  records.noise_std = Vector(records.noise_std(config.outputs));
  return records;
}

Random initial_guess(const ExperimentConfig& config, Index realisation) {
  return {static_cast<std::uint64_t>(config.data.seed), Stream::initial_guess, 0,
          static_cast<std::uint64_t>(realisation)};
}

double spring_r2(const Plant& plant, const QuarterCar& car, ConstMatrixRef u, ConstMatrixRef states, ConstMatrixRef f) {
  const Index n = plant.mass_count();
  Motion motion(plant);
  // The suspension stands between two masses: neither the rate of the inputs nor their paths bear on its force.
  const Vector at_rest = Vector::Zero(motion.inputs());
  Vector a(n), z_rate(motion.memories());
  Matrix force(1, states.cols());
  for (Index k = 0; k < force.cols(); ++k) {
    motion.set_inputs(u.col(k).data(), at_rest.data());
    const double* const q = states.col(k).data();
    if (motion.accelerations(q, q + n, q + 2 * n, a.data(), z_rate.data()) != Motion::all_defined)
      return std::numeric_limits<double>::quiet_NaN();
    force(k) = motion.element_force(car.suspension);
  }
  // Internal states of the laws are no part of the linear model: what they carry of the force stays in it.
  Matrix regressors(2 * n + u.rows(), force.cols());
  regressors << states.topRows(2 * n), u;
  const Matrix truth = nonlinear_part(force, regressors), identified = nonlinear_part(f, regressors);
  if (!(truth.squaredNorm() > 0)) return std::numeric_limits<double>::quiet_NaN();
  const double left = least_squares(identified, truth).residual_norm;
  return 1 - left * left / truth.squaredNorm();
}

}  // namespace wheelhop
