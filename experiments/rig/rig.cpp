#include "experiments/rig/rig.hpp"

#include <algorithm>
#include <cmath>

#include "experiments/rig/equations.hpp"

namespace wheelhop::blind {
namespace {

/// Steps below this length are taken whatever their error: only a kink of a law asks for them, and across a kink the
/// error of the step is of second order.
constexpr double shortest_step_s = 1e-5;
/// By how much a step is stretched so that no crumb is left at the end of an interval.
constexpr double stretch = 1.01;

/// The pair RK5(4)7M of Dormand & Prince (1980), J. Comput. Appl. Math. 6, table 2.
class DormandPrince {
 public:
  DormandPrince(Equations& equations, double accuracy) : equations_(equations), accuracy_(accuracy) {
    for (Vector* vector : {&k1, &k2_, &k3_, &k4_, &k5_, &k6_, &k7_, &trial_}) vector->setZero(equations.size());
    largest_ = Vector::Constant(equations.size(), 1e-9);
  }

  Vector k1;  ///< rate at the start of the next step; the caller sets it after every jump of the drive

  /// From t to `end` in steps as long as their errors allow.
  void advance(double t, double end, Vector& y) {
    while (t < end) {
      const bool last = t + stretch * step_ >= end;
      const double h = last ? end - t : step_;
      const double error = attempt(t, h, y);
      if (!std::isfinite(error)) throw RigFailure("the motion grew beyond all numbers");
      // 1/5 for order 5; a step cut short by the end of the interval says little about longer ones.
      const double factor = std::clamp(0.9 * std::pow(error + 1e-10, -0.2), 0.2, 4.0);
      // The last step of an interval may be stretched a little beyond the shortest, and must then be taken too.
      if (error > 1 && h > stretch * shortest_step_s) {
        step_ = std::max(shortest_step_s, h * factor);
        continue;
      }
      t = last ? end : t + h;
      y = trial_;
      k1 = k7_;
      largest_ = largest_.cwiseMax(y.cwiseAbs());
      step_ = std::max(last ? std::max(step_, h * factor) : h * factor, shortest_step_s);
      equations_.accept(t, y);
    }
  }

 private:
  double attempt(double t, double h, const Vector& y) {
    const auto rates = [&](double c, Vector& k) { equations_.rates(t + c * h, trial_, k); };
    trial_ = y + h * (1.0 / 5 * k1);
    rates(1.0 / 5, k2_);
    trial_ = y + h * (3.0 / 40 * k1 + 9.0 / 40 * k2_);
    rates(3.0 / 10, k3_);
    trial_ = y + h * (44.0 / 45 * k1 - 56.0 / 15 * k2_ + 32.0 / 9 * k3_);
    rates(4.0 / 5, k4_);
    trial_ = y + h * (19372.0 / 6561 * k1 - 25360.0 / 2187 * k2_ + 64448.0 / 6561 * k3_ - 212.0 / 729 * k4_);
    rates(8.0 / 9, k5_);
    trial_ = y + h * (9017.0 / 3168 * k1 - 355.0 / 33 * k2_ + 46732.0 / 5247 * k3_ + 49.0 / 176 * k4_ -
                      5103.0 / 18656 * k5_);
    rates(1, k6_);
    trial_ = y + h * (35.0 / 384 * k1 + 500.0 / 1113 * k3_ + 125.0 / 192 * k4_ - 2187.0 / 6784 * k5_ + 11.0 / 84 * k6_);
    rates(1, k7_);
    const auto error = h * (71.0 / 57600 * k1 - 71.0 / 16695 * k3_ + 71.0 / 1920 * k4_ - 17253.0 / 339200 * k5_ +
                            22.0 / 525 * k6_ - 1.0 / 40 * k7_);
    return (error.array() / (accuracy_ * largest_.array())).matrix().lpNorm<Eigen::Infinity>();
  }

  Equations& equations_;
  double accuracy_;
  double step_ = 1e-3;
  Vector k2_, k3_, k4_, k5_, k6_, k7_, trial_, largest_;
};

void widen(Extent& extent, double x, double v) {
  extent.least = std::min(extent.least, x);
  extent.most = std::max(extent.most, x);
  extent.rms += x * x;
  extent.speed_rms += v * v;
}

void finish(Extent& extent, double count) {
  extent.rms = std::sqrt(extent.rms / count);
  extent.speed_rms = std::sqrt(extent.speed_rms / count);
}

}  // namespace

Run run_rig(const Plan& plan, const Vector& theta, const std::vector<Mount>& mounts, const Matrix& felt,
            const RunOptions& options) {
  Equations equations(plan, theta, mounts);
  DormandPrince integrator(equations, options.accuracy);
  const Index N = felt.cols(), n = plan.mass_count();
  Run run;
  run.outputs.resize(static_cast<Index>(plan.sensors.size()), N);
  run.elements.resize(plan.elements.size());
  run.masses.resize(plan.masses.size());
  Vector state = Vector::Zero(equations.size()), u_rate = Vector::Zero(felt.rows());
  const double hold_s = 1 / plan.hold_hz;
  const auto time = [&](Index k) { return options.epoch_s + static_cast<double>(k - options.lead) * hold_s; };
  for (Index k = 0; k < N; ++k) {
    if (k > 0) u_rate = (felt.col(k) - felt.col(k - 1)) / hold_s;
    const Vector u = felt.col(k);
    equations.set_inputs(u.data(), u_rate.data());
    integrator.k1.setZero();
    equations.rates(time(k), state, integrator.k1);
    equations.outputs(run.outputs.col(k).data());
    if (k >= options.lead) {
      for (std::size_t e = 0; e < run.elements.size(); ++e)
        widen(run.elements[e], equations.travel(e), equations.travel_rate(e));
      for (Index i = 0; i < n; ++i) widen(run.masses[static_cast<std::size_t>(i)], state(i), state(n + i));
    }
    if (k + 1 < N) integrator.advance(time(k), time(k + 1), state);
  }
  if (!all_finite(run.outputs)) throw RigFailure("the motion grew beyond all numbers");
  for (Extent& extent : run.elements) finish(extent, static_cast<double>(N - options.lead));
  for (Extent& extent : run.masses) finish(extent, static_cast<double>(N - options.lead));
  return run;
}

}  // namespace wheelhop::blind
