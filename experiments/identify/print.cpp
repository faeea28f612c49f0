#include <fmt/format.h>

#include <cmath>
#include <filesystem>

#include "experiments/identify/study.hpp"

namespace wheelhop {
namespace {

std::string numbers(const Vector& values) {
  std::string text;
  for (const double value : values) text += fmt::format(" {:.4g}", value);
  return text;
}

/// "val.csv [100, 4100)": records may be parts of one file.
std::string label(const RecordScore& score) {
  return fmt::format("{} [{}, {})", std::filesystem::path(score.file).filename().string(), score.first,
                     score.first + score.samples);
}

void print_linear(const LinearSearch& search, const std::vector<Channel>& inputs) {
  const LinearEstimate& linear = search.estimate;
  fmt::print("step 1  order {}; held-out error by order (mean of the outputs' logs, %):", linear.order_used);
  for (const OrderTrial& trial : search.orders)
    fmt::print(" {}: {:.3g}", trial.order(), 100 * std::exp(trial.held_out_error.array().log().mean()));
  fmt::print("\n");
  for (std::size_t i = 0; i < inputs.size(); ++i)
    if (search.delay[i] > 0) fmt::print("        {} acts {} samples late\n", inputs[i].name, search.delay[i]);
}

void print_steps(const IdentifyConfig& config, const Delivery& delivery) {
  const PipelineResult& result = delivery.pipeline;
  std::string trained;
  for (const Index number : config.trained)
    trained += (trained.empty() ? "" : ", ") + config.set.records[static_cast<std::size_t>(number)].file;
  fmt::print("trained on {}; the outputs follow the input to order {} (needed: {})\n", trained, config.excitation_found,
             config.excitation_needed);
  if (delivery.search) {
    print_linear(*delivery.search, config.inputs);
  } else {
    const Vector& s = result.linear.singular_values;
    fmt::print("step 1  order {} (gap {:.3g}); singular values{}\n", result.linear.order_used, result.linear.gap,
               numbers(s.head(std::min<Index>(s.size(), result.linear.order_used + 3))));
  }
  if (config.delivery.pipeline.direction != "input" && config.delivery.pipeline.nonlinearities > 0)
    fmt::print("step 2  direction: residual {:.3g} of the linear residual; {} start(s) agree\n",
               result.direction.residual, result.direction.agreeing);
  for (std::size_t i = 0; i < result.passes.size(); ++i) {
    const Pass& pass = result.passes[i];
    fmt::print("pass {}  training VAF %{}{}{}\n", i + 1, numbers(pass.training_vaf),
               pass.status == Status::ok ? "" : fmt::format("  {}: {}", to_string(pass.status), pass.message),
               static_cast<Index>(i) == result.best ? "  (kept)" : "");
  }
  if (result.refinement.solution.iterations > 0)
    fmt::print("refined {} iterations: {}\n", result.refinement.solution.iterations,
               result.refinement.solution.message);
  fmt::print("delivered, as compared on {}: {}\n", delivery.held_out, delivery.reason);
}

/// "mode 1  1.05 +- 0.01 Hz, damping 0.31 +- 0.02".
void print_modes(const ModelUncertainty& found, double sampling_hz) {
  const double hz = sampling_hz / (2 * 3.14159265358979323846);
  Index number = 0;
  for (const UncertainPole& pole : found.poles) {
    if (pole.pole.imag() < 0 || !std::isfinite(pole.frequency)) continue;
    fmt::print("mode {}  {:.4g} +- {:.2g} Hz", ++number, pole.frequency * hz, kNinetyPercent * pole.frequency_std * hz);
    if (pole.pole.imag() > 0)
      fmt::print(", damping {:.4g} +- {:.2g}\n", pole.damping, kNinetyPercent * pole.damping_std);
    else
      fmt::print("{}\n", pole.pole.real() > 0 ? ", without oscillation" : ", from sample to sample");
  }
  if (number > 0) fmt::print("        (at rest, with 90 % intervals)\n");
}

}  // namespace

void print_identification(const IdentifyConfig& config, const Delivery& result, const ModelFile& model,
                          const std::vector<RecordScore>& scores) {
  print_steps(config, result);
  print_modes(result.uncertainty, model.sampling_hz);
  std::size_t width = 0;
  for (const RecordScore& score : scores) width = std::max(width, label(score).size());
  if (config.options.initial_state_samples > 0)
    fmt::print("\nfree run, initial state from the first {} samples and the states met in training\n",
               config.options.initial_state_samples);
  else
    fmt::print("\nfree run, initial state from the first periods of the slowest mode and the states met in training\n");
  fmt::print("{:<{}} {:<11} {:<26} {:>10} {:>10} {:>15} {:>10}\n", "record", width, "role", "output", "linear VAF",
             "VAF %", "RMSE", "NRMSE");
  for (const RecordScore& score : scores) {
    if (score.status != Status::ok) {
      fmt::print("{:<{}} {:<11} {}: {}\n", label(score), width, score.role, to_string(score.status), score.message);
      continue;
    }
    for (Index i = 0; i < score.vaf.size(); ++i) {
      const Channel& channel = config.outputs[static_cast<std::size_t>(i)];
      fmt::print("{:<{}} {:<11} {:<26} {:>10.2f} {:>10.4f} {:>15} {:>10.3g}\n", i == 0 ? label(score) : "", width,
                 i == 0 ? score.role : "", channel.name, score.linear_vaf(i), score.vaf(i),
                 fmt::format("{:.4g} {}", score.rmse(i), channel.unit), score.nrmse(i));
    }
    for (const Excess& excess : score.beyond)
      fmt::print("{:<{}} leaves the training range: {} by {:.3g}{}{} ({:.1f} % of it), {} samples\n", "", width,
                 excess.channel, excess.distance, excess.unit.empty() ? "" : " ", excess.unit, 100 * excess.share,
                 excess.samples);
  }
  if (model.status == Status::ok && !model.message.empty()) fmt::print("\nnote: {}\n", model.message);
  if (model.status != Status::ok) fmt::print("\n{}: {}\n", to_string(model.status), model.message);
}

}  // namespace wheelhop
