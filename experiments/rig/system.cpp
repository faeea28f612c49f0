#include "experiments/rig/system.hpp"

#include <algorithm>
#include <cmath>

namespace wheelhop::blind {
namespace {

Index hold_samples(const Plan& plan, double seconds) {
  return static_cast<Index>(std::llround(seconds * plan.hold_hz));
}

Index samples_per_record_sample(const Plan& plan) { return static_cast<Index>(std::llround(plan.hold_hz / record_hz)); }

/// What an input imposes on `count` hold intervals from the start of the lead: paths that change samples work at twice
/// the hold rate.
Vector felt_by_plant(const TrueSystem& system, Index input, const Playback& playback, Index lead, Index count) {
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
  if (rate == 1 && delay == 0 && changes.empty() && count == playback.held.cols())
    return playback.held.row(input).transpose();
  const Index finer = changes.empty() ? 1 : 2;
  const double fine_hz = hold_hz * static_cast<double>(finer), start = -static_cast<double>(lead) / hold_hz;
  Vector u = sample_command(playback.commands[static_cast<std::size_t>(input)], start * rate - delay, rate / fine_hz,
                            count * finer);
  for (const auto& change : changes) change(u, fine_hz);
  Vector held(count);
  for (Index k = 0; k < count; ++k) held(k) = u(k * finer);
  return held;
}

}  // namespace

Vector read_at(const Matrix& samples, double position) {
  const Index last = samples.cols() - 3;
  const Index k = std::clamp(static_cast<Index>(std::floor(position)), Index{1}, last);
  const double s = position - static_cast<double>(k);
  return -s * (s - 1) * (s - 2) / 6 * samples.col(k - 1) + (s + 1) * (s - 1) * (s - 2) / 2 * samples.col(k) -
         (s + 1) * s * (s - 2) / 2 * samples.col(k + 1) + (s + 1) * s * (s - 1) / 6 * samples.col(k + 2);
}

Playback play(const Plan& plan, std::vector<Command> commands, const ObserveOptions& options) {
  const Index lead = hold_samples(plan, options.lead_s);
  const Index count = lead + options.samples * samples_per_record_sample(plan);
  Playback playback{std::move(commands), Matrix(static_cast<Index>(plan.inputs.size()), count)};
  for (Index i = 0; i < playback.held.rows(); ++i)
    playback.held.row(i) = sample_command(playback.commands[static_cast<std::size_t>(i)],
                                          -static_cast<double>(lead) / plan.hold_hz, 1 / plan.hold_hz, count)
                               .transpose();
  return playback;
}

Observation observe(const TrueSystem& system, const Playback& playback, const ObserveOptions& options) {
  const Plan& plan = *system.plan;
  const Index ratio = samples_per_record_sample(plan), lead = hold_samples(plan, options.lead_s);
  double recorder = 1;
  for (const TrueEffect& effect : system.effects) recorder *= effect.recorder_rate;
  Index count = playback.held.cols();
  // A recorder of too long an interval still records when the nominal end is over; two samples more to read between.
  if (recorder > 1) count = lead + static_cast<Index>(std::ceil(static_cast<double>(count - lead) * recorder)) + 2;
  Matrix felt(playback.held.rows(), count);
  for (Index i = 0; i < felt.rows(); ++i) felt.row(i) = felt_by_plant(system, i, playback, lead, count).transpose();
  Observation result;
  result.command.resize(felt.rows(), options.samples);
  for (Index k = 0; k < options.samples; ++k) result.command.col(k) = playback.held.col(lead + k * ratio);
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
  for (Index k = 0; k < options.samples; ++k)
    if (recorder == 1)
      result.clean.col(k) = run.outputs.col(lead + k * ratio);
    else
      result.clean.col(k) = read_at(run.outputs, static_cast<double>(lead) + static_cast<double>(k * ratio) * recorder);
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
