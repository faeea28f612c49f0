#include "core/plant/simulate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/plant/linearise.hpp"
#include "core/plant/tangent.hpp"

namespace wheelhop {
namespace {

constexpr double kMemorySpeed = 1;  // m/s, at which laws with memory are judged: fast travel of a damper

/// Classical Runge-Kutta of fourth order on q' = v, v' = a(q, v, z), z' = g(q, v, z).
class Stepper {
 public:
  Stepper(Motion& motion, Tangent* tangent) : motion_(motion), tangent_(tangent) {
    const Index n = motion.masses();
    for (Vector* x : {&q_, &a1_, &a2_, &a3_, &a4_, &v2_, &v3_, &v4_}) x->setZero(n);
    for (Vector* z : {&z_, &r1_, &r2_, &r3_, &r4_}) z->setZero(motion.memories());
  }

  /// First stage of the step from (q, v, z): the accelerations there, which an output may read as well.
  int begin(const double* q, const double* v, const double* z) {
    if (const int e = motion_.accelerations(q, v, z, a1_.data(), r1_.data()); e >= 0) return e;
    return tangent_ ? tangent_->begin(motion_, z, a1_.data()) : Motion::all_defined;
  }
  const double* accelerations() const { return a1_.data(); }

  /// The step of length h that was begun at (q, v, z), in place. Every stage is checked: a stage beyond the pole of an
  /// end stop would read a force of the wrong sign and go on as if nothing had happened.
  int finish(double h, double* q, double* v, double* z) {
    const Index n = q_.size(), s = z_.size();
    for (Index i = 0; i < n; ++i) {
      q_[i] = q[i] + 0.5 * h * v[i];
      v2_[i] = v[i] + 0.5 * h * a1_[i];
    }
    for (Index i = 0; i < s; ++i) z_[i] = z[i] + 0.5 * h * r1_[i];
    if (int e = stage(0.5 * h, 2, v2_, a2_, r2_); e >= 0) return e;
    for (Index i = 0; i < n; ++i) {
      q_[i] = q[i] + 0.5 * h * v2_[i];
      v3_[i] = v[i] + 0.5 * h * a2_[i];
    }
    for (Index i = 0; i < s; ++i) z_[i] = z[i] + 0.5 * h * r2_[i];
    if (int e = stage(0.5 * h, 2, v3_, a3_, r3_); e >= 0) return e;
    for (Index i = 0; i < n; ++i) {
      q_[i] = q[i] + h * v3_[i];
      v4_[i] = v[i] + h * a3_[i];
    }
    for (Index i = 0; i < s; ++i) z_[i] = z[i] + h * r3_[i];
    if (int e = stage(h, 1, v4_, a4_, r4_); e >= 0) return e;
    for (Index i = 0; i < n; ++i) {
      q[i] += h / 6 * (v[i] + 2 * (v2_[i] + v3_[i]) + v4_[i]);
      v[i] += h / 6 * (a1_[i] + 2 * (a2_[i] + a3_[i]) + a4_[i]);
    }
    for (Index i = 0; i < s; ++i) z[i] += h / 6 * (r1_[i] + 2 * (r2_[i] + r3_[i]) + r4_[i]);
    if (tangent_) tangent_->finish(h);
    return Motion::all_defined;
  }

 private:
  int stage(double c, double weight, const Vector& v, Vector& a, Vector& r) {
    if (const int e = motion_.accelerations(q_.data(), v.data(), z_.data(), a.data(), r.data()); e >= 0) return e;
    return tangent_ ? tangent_->stage(c, weight, motion_, z_.data(), a.data()) : Motion::all_defined;
  }

  Motion& motion_;
  Tangent* const tangent_;
  Vector q_, v2_, v3_, v4_, a1_, a2_, a3_, a4_;
  Vector z_, r1_, r2_, r3_, r4_;
};

void check_shapes(const Plant& plant, Index memories, ConstMatrixRef drive, const SimulateOptions& options) {
  if (drive.rows() != plant.input_count())
    throw UserError(fmt::format("plant \"{}\": expected a drive with {} rows (one an input), found {}", plant.name,
                                plant.input_count(), drive.rows()));
  if (options.substeps < 1 || options.decimation < 1 || options.lead_samples < 0)
    throw UserError("simulate: expected substeps >= 1, decimation >= 1 and lead_samples >= 0");
  if (options.lead_samples >= drive.cols())
    throw UserError(fmt::format("simulate: expected a drive longer than its {} lead samples, found {} samples",
                                options.lead_samples, drive.cols()));
  if (options.sampled_drive.size() != 0 &&
      (options.sampled_drive.rows() != drive.rows() || options.sampled_drive.cols() != drive.cols()))
    throw UserError("simulate: expected a sampled drive of the drive's shape");
  const Index size = options.initial_state.size();
  if (size != 0 && size != 2 * plant.mass_count() && size != 2 * plant.mass_count() + memories)
    throw UserError(
        fmt::format("simulate: expected an initial state of {} numbers (positions, velocities) or {} more "
                    "(internal states), found {}",
                    2 * plant.mass_count(), memories, size));
}

/// Fastest pole [1/s] of the plant linearised at zero; 0 where it cannot be.
double fastest_pole(const Plant& plant) {
  const LinearPlant model = linearise(plant);
  return model.A.size() == 0 ? 0 : eigenvalues(model.A).cwiseAbs().maxCoeff();
}

/// Steps in one hold interval with which |s| h <= 2.
Index steps_for(double fastest, double hold_s, Index least, Index most) {
  const double steps = std::ceil(0.5 * fastest * hold_s);
  return static_cast<Index>(std::clamp(steps, static_cast<double>(least), static_cast<double>(most)));
}

}  // namespace

Simulation simulate(const Plant& plant, ConstMatrixRef drive, const SimulateOptions& options, Tangent* tangent) {
  Motion motion(plant);
  check_shapes(plant, motion.memories(), drive, options);
  const double hold_s = 1 / plant.hold_hz();
  const Index n = plant.mass_count(), m = plant.input_count(), N = drive.cols();
  const Index size = 2 * n + motion.memories();
  const Index kept = (N - options.lead_samples - 1) / options.decimation + 1;

  Simulation result;
  const auto fail = [&](Status status, std::string message, Index column, double time_s) {
    result.status = status;
    result.message = std::move(message);
    result.failure_time_s = time_s;
    result.states.conservativeResize(size, column);
    result.outputs.conservativeResize(plant.sensor_count(), column);
    return result;
  };
  const double start_s = -static_cast<double>(options.lead_samples) * hold_s;
  if (!all_finite(drive) || !all_finite(options.sampled_drive) || !all_finite(options.initial_state))
    return fail(Status::not_finite, "the drive or the initial state is not finite", 0, start_s);

  Vector state = Vector::Zero(size);
  if (options.initial_state.size() != 0) {
    state.head(options.initial_state.size()) = options.initial_state;
  } else if (options.from_equilibrium) {
    const Equilibrium equilibrium = static_equilibrium(plant, drive.col(0));
    if (equilibrium.status != Status::ok) return fail(equilibrium.status, equilibrium.message, 0, start_s);
    state.head(n) = equilibrium.positions;
  }
  result.states.resize(size, kept);
  result.outputs.resize(plant.sensor_count(), kept);

  const bool adapts = motion.memories() > 0 && options.most_substeps > options.substeps;
  Index substeps = options.substeps;
  Stepper stepper(motion, tangent);
  Vector u_rate = Vector::Zero(m), u_step = u_rate;
  double* const q = state.data();
  double* const v = state.data() + n;
  double* const z = state.data() + 2 * n;
  const auto left_domain = [&](int element, Index column, Index k) {
    const double time_s = start_s + static_cast<double>(k) * hold_s;
    return fail(Status::outside_domain,
                fmt::format("element \"{}\" left the domain of its laws at t = {:.6g} s (travel {:.6g} m): the drive "
                            "is too strong for this plant, or the step of {:.6g} s too long",
                            plant.elements[static_cast<std::size_t>(element)].name, time_s, motion.travel(element),
                            hold_s / static_cast<double>(substeps)),
                column, time_s);
  };
  Index column = 0;
  for (Index k = 0; k < N; ++k) {
    if (k > 0)
      for (Index i = 0; i < m; ++i) {
        u_step[i] = drive(i, k) - drive(i, k - 1);
        u_rate[i] = u_step[i] / hold_s;
      }
    if (tangent) tangent->step_memories(motion, k, u_step.data(), z);
    motion.step_memories(u_step.data(), z);
    const bool apart = options.sampled_drive.size() != 0;
    motion.set_inputs(apart ? options.sampled_drive.col(k).data() : drive.col(k).data(), u_rate.data());
    if (tangent) tangent->set_inputs(motion, k, apart, hold_s);
    bool begun = false;
    if (k >= options.lead_samples && (k - options.lead_samples) % options.decimation == 0) {
      if (int e = stepper.begin(q, v, z); e >= 0) return left_domain(e, column, k);
      motion.outputs(q, v, stepper.accelerations(), result.outputs.col(column).data());
      result.states.col(column) = state;
      if (tangent) tangent->read(motion, column);
      ++column;
      begun = !apart;  // under another drive the first stage is another one
    }
    if (k + 1 == N) break;  // nobody asks for the state after the last sample
    if (apart) motion.set_inputs(drive.col(k).data(), u_rate.data());
    if (apart && tangent) tangent->set_inputs(motion, k, false, hold_s);
    for (Index s = 0; s < substeps; ++s) {
      if (!begun)
        if (int e = stepper.begin(q, v, z); e >= 0) return left_domain(e, column, k);
      if (adapts && s == 0)
        substeps = steps_for(motion.fastest_yielding(), hold_s, options.substeps, options.most_substeps);
      const double h = hold_s / static_cast<double>(substeps);
      if (int e = stepper.finish(h, q, v, z); e >= 0) return left_domain(e, column, k);
      begun = false;
    }
  }
  if (!all_finite(result.states) || !all_finite(result.outputs))
    return fail(Status::not_finite, "the state grew beyond all numbers", 0, start_s);
  return result;
}

Index stable_substeps(const Plant& plant, Index cap) {
  double fastest = fastest_pole(plant);
  if (fastest > 0)
    for (const Element& element : plant.elements)
      for (const Law& law : element.laws)
        fastest = std::max({fastest, decay(law, kMemorySpeed), decay(law, -kMemorySpeed)});
  return steps_for(fastest, 1 / plant.hold_hz(), 1, cap);
}

SimulateOptions sparing_steps(const Plant& plant, Index cap, Index most) {
  return {.substeps = steps_for(fastest_pole(plant), 1 / plant.hold_hz(), 1, cap), .most_substeps = most};
}

}  // namespace wheelhop
