#include "experiments/blind/truth/system.hpp"

#include <cmath>

namespace wheelhop::blind {
namespace {

/// What an input imposes, at the hold rate: paths that change samples work at twice that rate.
Vector felt_by_plant(const TrueSystem& system, Index input, const Command& command, Index lead, Index count) {
  const double hold_hz = system.plan->hold_hz;
  double rate = 1, delay = 0;
  std::vector<std::function<void(Vector&, double)>> changes;
  for (const TrueEffect& effect : system.effects)
    for (const DriveStep& step : effect.drive)
      if (step.input == input) {
        rate *= step.rate;
        delay += step.delay_s;
        if (step.change) changes.push_back(step.change);
      }
  const Index finer = changes.empty() ? 1 : 2;
  const double fine_hz = hold_hz * static_cast<double>(finer), start = -static_cast<double>(lead) / hold_hz;
  Vector u = sample_command(command, start * rate - delay, rate / fine_hz, count * finer);
  for (const auto& change : changes) change(u, fine_hz);
  if (finer == 1) return u;
  Vector held(count);
  for (Index k = 0; k < count; ++k) held(k) = u(k * finer);
  return held;
}

}  // namespace

Observation observe(const TrueSystem& system, const std::vector<Command>& commands, const ObserveOptions& options) {
  const Plan& plan = *system.plan;
  const auto ratio = static_cast<Index>(std::llround(plan.hold_hz / record_hz));
  const auto lead = static_cast<Index>(std::llround(options.lead_s * plan.hold_hz));
  const Index count = lead + options.samples * ratio, m = static_cast<Index>(plan.inputs.size());
  Matrix felt(m, count);
  Observation result;
  result.command.resize(m, options.samples);
  for (Index i = 0; i < m; ++i) {
    const Command& command = commands[static_cast<std::size_t>(i)];
    felt.row(i) = felt_by_plant(system, i, command, lead, count).transpose();
    result.command.row(i) = sample_command(command, 0, 1 / record_hz, options.samples).transpose();
  }
  Vector theta = system.theta;
  std::vector<Mount> mounts;
  for (const TrueEffect& effect : system.effects) {
    for (const auto& [at, factor] : effect.factors) theta(at) *= factor;
    mounts.insert(mounts.end(), effect.mounts.begin(), effect.mounts.end());
  }
  Run run = run_rig(plan, theta, mounts, felt, {lead, options.epoch_s, options.accuracy});
  for (const TrueEffect& effect : system.effects)
    for (const SensorStep& step : effect.sensors) step(run.outputs, lead, plan.hold_hz);
  result.clean.resize(run.outputs.rows(), options.samples);
  for (Index k = 0; k < options.samples; ++k) result.clean.col(k) = run.outputs.col(lead + k * ratio);
  result.elements = std::move(run.elements);
  result.masses = std::move(run.masses);
  return result;
}

void convert(const TrueSystem& system, Matrix& y) {
  for (const TrueEffect& effect : system.effects)
    for (const auto& [sensor, step] : effect.quanta)
      for (double& value : y.row(sensor)) value = step * std::round(value / step);
}

}  // namespace wheelhop::blind
