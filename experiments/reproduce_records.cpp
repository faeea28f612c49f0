#include "experiments/reproduce_records.hpp"

#include <cmath>
#include <limits>

#include "core/data/noise.hpp"
#include "core/plant/dataset.hpp"
#include "core/plant/motion.hpp"

namespace wheelhop {
namespace {

/// The same numbers as `generate` draws for a config whose records are these two.
GeneratedRecord make_record(const ReproduceConfig& config, Index which, double seconds, Index realisation) {
  const Plant& plant = config.plant;
  const double hold_hz = plant.hold_hz();
  const Index lead = std::llround(config.settle_s * hold_hz);
  const Index samples =
      std::llround(seconds * config.sampling_hz) * hold_samples_per_record_sample(plant, config.sampling_hz);
  Matrix drive(plant.input_count(), lead + samples);
  for (Index i = 0; i < plant.input_count(); ++i) {
    Random random(static_cast<std::uint64_t>(config.seed), Stream::road, static_cast<std::uint64_t>(which * 4096 + i),
                  static_cast<std::uint64_t>(realisation));
    drive.row(i) = make_drive(config.drive, hold_hz, lead, samples, random).values;
  }
  return generate_record(unquantised(plant), drive, config.sampling_hz,
                         {.substeps = config.substeps, .lead_samples = lead, .from_equilibrium = true});
}

/// What is left of the rows of `signal` (r x N) after regression on a constant and the rows of `regressors`.
Matrix nonlinear_part(ConstMatrixRef signal, ConstMatrixRef regressors) {
  Matrix columns(signal.cols(), regressors.rows() + 1);
  columns << Vector::Ones(signal.cols()), regressors.transpose();
  const Matrix target = signal.transpose();
  return target - columns * least_squares(columns, target).x;
}

}  // namespace

SimulatedRecords simulate_records(const ReproduceConfig& config, Index realisation) {
  SimulatedRecords records;
  const char* names[] = {"training", "validation"};
  const double seconds[] = {config.estimation_s, config.validation_s};
  for (Index which = 0; which < 2; ++which) {
    GeneratedRecord record = make_record(config, which, seconds[which], realisation);
    records.status = record.status;
    if (record.status != Status::ok) {
      records.message = std::string(names[which]) + " record: " + record.message;
      return records;
    }
    Signal& signal = which == 0 ? records.training : records.validation;
    signal = std::move(record.signal);
    (which == 0 ? records.training_states : records.validation_states) = std::move(record.states);
    if (which == 1) records.clean = signal.y;
    records.noise_std = Vector::Zero(signal.output_count());
    if (config.snr_db) {
      Random random(static_cast<std::uint64_t>(config.seed), Stream::noise, static_cast<std::uint64_t>(which),
                    static_cast<std::uint64_t>(realisation));
      records.noise_std = add_noise(signal, *config.snr_db, random);
    }
    quantise(config.plant, signal.y);
  }
  return records;
}

double spring_r2(const ReproduceConfig& config, ConstMatrixRef u, ConstMatrixRef states, ConstMatrixRef f) {
  const Index n = config.plant.mass_count();
  Motion motion(config.plant);
  // The suspension stands between two masses: neither the rate of the inputs nor their paths bear on its force.
  const Vector at_rest = Vector::Zero(motion.inputs());
  Vector a(n), z_rate(motion.memories());
  Matrix force(1, states.cols());
  for (Index k = 0; k < force.cols(); ++k) {
    motion.set_inputs(u.col(k).data(), at_rest.data());
    const double* const q = states.col(k).data();
    if (motion.accelerations(q, q + n, q + 2 * n, a.data(), z_rate.data()) != Motion::all_defined)
      return std::numeric_limits<double>::quiet_NaN();
    force(k) = motion.element_force(config.car.suspension);
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
