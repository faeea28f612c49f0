#include "experiments/identify/identify.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "core/base/files.hpp"
#include "core/data/metrics.hpp"
#include "core/data/slow_channels.hpp"
#include "core/identify/initial_state.hpp"
#include "core/identify/judgements.hpp"
#include "core/identify/uncertainty.hpp"
#include "experiments/identify/study.hpp"
#include "experiments/run/file_uses.hpp"
#include "experiments/run/provenance.hpp"

namespace wheelhop {

Vector initial_state(const ModelFile& model, const Signal& record, Index samples) {
  if (samples == 0) samples = initial_state_span(model.model.linear, record.samples());
  return estimate_initial_state(model.model, acting_inputs(model, record.u),
                                Matrix(model.y_scale.cwiseInverse().asDiagonal() * record.y), samples,
                                longest_delay(model), model.states);
}

namespace {

/// Share of a residual's square from which on it is told that it is no noise: the free-run error is then 1.1 times a
/// white noise or more.
constexpr double kNoNoise = 0.2;

/// Initial state of the i-th record that was fitted. With delays the fit begins where all inputs are known, and the
/// state before is estimated anew.
Vector trained_state(const ModelFile& file, const Delivery& result, const Signal& record, std::size_t i) {
  if (longest_delay(file) == 0) return result.x0[i];
  return initial_state(file, record, 4 * initial_state_span(file.model.linear, record.samples()));
}

Extremes together(const Extremes& a, const Extremes& b) { return {a.low.cwiseMin(b.low), a.high.cwiseMax(b.high)}; }

Envelope together(const Envelope& a, const Envelope& b) {
  return {together(a.u, b.u), together(a.y, b.y), together(a.f, b.f)};
}

ModelFile make_file(const IdentifyConfig& config, const Delivery& result) {
  ModelFile file;
  file.status = result.status;
  file.message = result.message;
  file.inputs = config.inputs;
  file.outputs = config.outputs;
  file.sampling_hz = config.set.sampling_hz;
  file.u_scale = result.channels.u_scale;
  file.u_offset = result.channels.u_offset;
  file.delay = result.channels.delay;
  file.y_scale = result.channels.y_scale;
  file.limits = result.limits;
  file.model = result.model;
  file.states = result.states;
  file.config = config.effective;
  file.provenance = provenance(config.set);
  file.provenance["judgements"] = to_json(kJudged);
  if (result.status != Status::ok) return file;
  const auto training = [&](std::size_t i) -> const Signal& {
    return config.set.records[static_cast<std::size_t>(config.trained[i])].signal;
  };
  file.x0 = trained_state(file, result, training(0), 0);
  for (std::size_t i = 0; i < config.trained.size(); ++i) {
    const Signal& record = training(i);
    const FreeRun run = free_run(file, record.u, i == 0 ? file.x0 : trained_state(file, result, record, i));
    const Envelope own{extremes_of(record.u), extremes_of(record.y), extremes_of(run.f)};
    file.envelope = i == 0 ? own : together(file.envelope, own);
    if (run.status == Status::ok) continue;
    file.status = run.status;
    file.message = fmt::format("the free run on the training record diverged at {:g} s",
                               static_cast<double>(run.stopped_at) * record.sample_time_s);
    return file;
  }
  std::vector<std::string> notes;
  if (const double radius = spectral_radius(linearised_at_rest(file.model).A); !(radius < 1))
    notes.push_back(fmt::format(
        "the model is unstable at rest: largest pole modulus {:.6f}. With a constant input it leaves its rest position "
        "for a motion that its nonlinearity bounds; its free runs on the records hold, those on drives much smaller "
        "than in training may not",
        radius));
  for (std::size_t i = 0; i < file.outputs.size(); ++i)
    if (const double share = result.unexplained(static_cast<Index>(i)); share > kNoNoise)
      notes.push_back(fmt::format(
          "what the model leaves of \"{}\" is not white noise: {:.0f} % of its square follows from its past and the "
          "inputs. The model is incomplete there, or the sensor's noise is coloured",
          file.outputs[i].name, 100 * share));
  file.message = fmt::format("{}", fmt::join(notes, "; "));
  return file;
}

/// The same channels with the linear model alone.
ModelFile linear_file(const ModelFile& file, const Delivery& delivery) {
  ModelFile result = file;
  result.model = without_map(delivery.linear, delivery.model.limits);
  result.states = delivery.linear_states;
  return result;
}

RecordScore score_record(const IdentifyConfig& config, const Delivery& result, const ModelFile& model,
                         std::size_t index) {
  const Record& record = config.set.records[index];
  const Signal& signal = record.signal;
  const Index skip = std::max(signal.skip, std::min(longest_delay(model), signal.samples() - 1));
  RecordScore score;
  score.file = record.file;
  score.role = record.role;
  score.first = record.first;
  score.samples = signal.samples();
  const ModelFile linear = linear_file(model, result);
  score.linear_vaf = vaf_percent(
      signal.y, free_run(linear, signal.u, initial_state(linear, signal, config.options.initial_state_samples)).y,
      skip);
  const bool trained = config.trains_on(index);
  Vector x0;
  if (trained) {
    const auto place = std::find(config.trained.begin(), config.trained.end(), static_cast<Index>(index));
    x0 = trained_state(model, result, signal, static_cast<std::size_t>(place - config.trained.begin()));
  } else {
    x0 = initial_state(model, signal, config.options.initial_state_samples);
  }
  const FreeRun run = free_run(model, signal.u, x0);
  score.status = run.status;
  if (run.status != Status::ok) {
    score.message =
        fmt::format("the free run diverged at {:g} s", static_cast<double>(run.stopped_at) * signal.sample_time_s);
    return score;
  }
  score.vaf = vaf_percent(signal.y, run.y, skip);
  score.rmse = rmse(signal.y, run.y, skip);
  score.nrmse = nrmse(signal.y, run.y, skip);
  if (trained) return score;
  score.beyond = beyond_envelope(model, signal.u, run.y, run.f);
  for (Index k = 0; k < run.y.cols(); ++k)
    score.samples_beyond += !beyond_envelope(model, signal.u.col(k), run.y.col(k), run.f.col(k)).empty();
  return score;
}

Json score_json(const IdentifyConfig& config, const RecordScore& score, bool trained) {
  const auto by_output = [&](const Vector& values) {
    Json out = Json::object();
    for (Index i = 0; i < values.size(); ++i) out[config.outputs[static_cast<std::size_t>(i)].name] = values(i);
    return out;
  };
  Json out = {{"file", score.file},
              {"role", score.role},
              {"range", {score.first, score.first + score.samples}},
              {"trained_on", trained},
              {"status", std::string(to_string(score.status))},
              {"message", score.message},
              {"vaf_percent", by_output(score.vaf)},
              {"rmse", by_output(score.rmse)},
              {"nrmse", by_output(score.nrmse)},
              {"linear_vaf_percent", by_output(score.linear_vaf)},
              {"samples_beyond_training", score.samples_beyond},
              {"beyond_training", Json::array()}};
  for (const Excess& excess : score.beyond)
    out["beyond_training"].push_back({{"channel", excess.channel},
                                      {"unit", excess.unit},
                                      {"samples", excess.samples},
                                      {"distance", excess.distance},
                                      {"share_of_range", excess.share}});
  return out;
}

/// @param least value that the quantity may have
Json interval(double value, double std, double least) {
  return {std::max(least, value - kNinetyPercent * std), value + kNinetyPercent * std};
}

/// Intervals of 90 %, in Hz and in the units of the channels. What the records leave open has an infinite upper end, in
/// a file null.
Json uncertainty_json(const ModelFile& file, const ModelUncertainty& found) {
  if (!found.known()) return nullptr;
  const double hz = file.sampling_hz / (2 * 3.14159265358979323846);  // of a radian a sample
  Json poles = Json::array();
  for (const UncertainPole& pole : found.poles)
    if (pole.pole.imag() >= 0 && std::isfinite(pole.frequency))  // one of each pair
      poles.push_back({{"pole", {pole.pole.real(), pole.pole.imag()}},
                       {"frequency_hz", pole.frequency * hz},
                       {"frequency_interval_hz", interval(pole.frequency * hz, pole.frequency_std * hz, 0)},
                       {"damping_ratio", pole.damping},
                       {"damping_interval", interval(pole.damping, pole.damping_std, -1)}});
  std::vector<double> frequencies;
  for (const UncertainResponse& at : found.responses) frequencies.push_back(at.frequency * hz);
  Json responses = Json::array();
  for (std::size_t o = 0; o < file.outputs.size(); ++o)
    for (std::size_t i = 0; i < file.inputs.size(); ++i) {
      const auto row = static_cast<Index>(o), column = static_cast<Index>(i);
      const double unit = file.y_scale(row) / file.u_scale(column);
      std::vector<double> real, imaginary, magnitude, real_std, imaginary_std, low, high;
      for (const UncertainResponse& at : found.responses) {
        const std::complex<double> value = unit * at.value(row, column);
        const double margin = kNinetyPercent * unit * at.magnitude_std(row, column);
        real.push_back(value.real());
        imaginary.push_back(value.imag());
        real_std.push_back(unit * at.real_std(row, column));
        imaginary_std.push_back(unit * at.imaginary_std(row, column));
        magnitude.push_back(std::abs(value));
        low.push_back(std::max(0.0, magnitude.back() - margin));
        high.push_back(magnitude.back() + margin);
      }
      responses.push_back({{"input", file.inputs[i].name},
                           {"output", file.outputs[o].name},
                           {"real", real},
                           {"imaginary", imaginary},
                           {"real_std", real_std},
                           {"imaginary_std", imaginary_std},
                           {"magnitude", magnitude},
                           {"magnitude_low", low},
                           {"magnitude_high", high}});
    }
  Json free_run_std = Json::object();
  for (std::size_t o = 0; o < file.outputs.size(); ++o)
    free_run_std[file.outputs[o].name] = file.y_scale(static_cast<Index>(o)) * found.output_std(static_cast<Index>(o));
  return {{"interval", 0.9},
          {"residual_blocks", found.blocks},
          {"poles_at_rest", poles},
          {"frequency_hz", frequencies},
          {"frequency_response_at_rest", responses},
          {"free_run_std", free_run_std}};
}

Json search_json(const LinearSearch& search) {
  Json orders = Json::array();
  for (const OrderTrial& trial : search.orders)
    orders.push_back(
        {{"order", trial.order()},
         {"block_length", trial.stride},
         {"held_out_error", std::vector<double>(trial.held_out_error.begin(), trial.held_out_error.end())}});
  return {{"orders", orders}, {"delay_samples", search.delay}};
}

Json candidates_json(const Delivery& delivery) {
  Json list = Json::array();
  for (const Candidate& candidate : delivery.candidates)
    list.push_back({{"name", candidate.name},
                    {"diverged", candidate.stopped},
                    {"held_out_nrmse", candidate.stopped ? Json()
                                                         : Json(std::vector<double>(candidate.held_out_nrmse.begin(),
                                                                                    candidate.held_out_nrmse.end()))}});
  return {{"compared_on", delivery.held_out},
          {"candidates", list},
          {"chosen", delivery.candidates[delivery.chosen].name},
          {"unexplained_share", std::vector<double>(delivery.unexplained.begin(), delivery.unexplained.end())},
          {"reason", delivery.reason}};
}

Json scores_json(const IdentifyConfig& config, const Delivery& delivery, const std::vector<RecordScore>& scores) {
  const PipelineResult& result = delivery.pipeline;
  const Vector& values = result.linear.singular_values;
  Json out = {
      {"order", result.linear.order_used},
      {"gap", result.linear.gap},
      {"singular_values", std::vector<double>(values.begin(), values.begin() + std::min<Index>(values.size(), 12))},
      {"factor", {{"method", result.linear.factor}, {"error", result.linear.factor_error}}},
      {"excitation_order", config.excitation_found},
      {"direction_residual", result.direction.residual},
      {"agreeing_starts", result.direction.agreeing},
      {"passes", Json::array()},
      {"best_pass", result.best + 1},
      {"refinement", to_json(result.refinement)},
      {"delivered", candidates_json(delivery)},
      {"records", Json::array()}};
  if (delivery.search) out["linear_search"] = search_json(*delivery.search);
  for (const Pass& pass : result.passes)
    out["passes"].push_back(
        {{"status", std::string(to_string(pass.status))},
         {"message", pass.message},
         {"training_vaf_percent", std::vector<double>(pass.training_vaf.begin(), pass.training_vaf.end())}});
  for (std::size_t i = 0; i < scores.size(); ++i)
    out["records"].push_back(score_json(config, scores[i], config.trains_on(i)));
  return out;
}

/// Says which outputs were read less often than their record has samples: a model takes every sample for a reading. A
/// drive may be held for as long as it likes.
void warn_of_slow_channels(const std::vector<Signal>& training) {
  std::vector<std::string> told;
  for (const Signal& signal : training) {
    const std::vector<SlowChannel> slow = slow_channels(signal.y);
    for (std::size_t i = 0; i < slow.size(); ++i) {
      const std::string& name = signal.outputs[i].name;
      if (slow[i].before.empty() || std::find(told.begin(), told.end(), name) != told.end()) continue;
      told.push_back(name);
      std::fprintf(stderr,
                   "%s was read every %.3g samples (%.4g Hz), %s: the model takes each sample for a reading, and so it "
                   "learns the logger as well; a record at that rate (\"resample_hz\", or a faster channel) does not\n",
                   name.c_str(), slow[i].samples, 1 / (signal.sample_time_s * slow[i].samples),
                   slow[i].lines ? "with straight lines in between" : "and repeated in between");
    }
  }
}

}  // namespace

int run_identify(const IdentifyRequest& request) {
  const std::filesystem::path& out = request.out;
  FileUses()
      .reads_named("CONFIG", request.config)
      .reads_named("--records", request.records)
      .writes("--out", out)
      .check();
  const IdentifyConfig config = read_identify_config(request.config, request.records);
  std::vector<Signal> training = config.training();
  if (!request.quiet)
    for (std::size_t i = 0; i < training.size(); ++i)
      std::fprintf(stderr, "identifying from %s: %td samples, %td input(s), %td output(s)\n",
                   config.set.records[static_cast<std::size_t>(config.trained[i])].file.c_str(), training[i].samples(),
                   training[i].input_count(), training[i].output_count());
  if (!request.quiet) warn_of_slow_channels(training);
  Random random(static_cast<std::uint64_t>(config.options.seed), Stream::initial_guess);
  const Delivery result =
      deliver(std::move(training), config.delivery, config.pieces.borrowed(config.delivery.pipeline), random);
  ModelFile model = make_file(config, result);
  if (result.status != Status::ok) {
    write_json(out, without_model(model));
    std::fprintf(stderr, "no model: %s: %s\n", std::string(to_string(model.status)).c_str(), model.message.c_str());
    return 1;
  }
  std::vector<RecordScore> scores;
  for (std::size_t i = 0; i < config.set.records.size(); ++i) {
    scores.push_back(score_record(config, result, model, i));
    if (scores.back().status != Status::ok && model.status == Status::ok) {
      model.status = scores.back().status;
      model.message = scores.back().file + ": " + scores.back().message;
    }
  }
  model.uncertainty = uncertainty_json(model, result.uncertainty);
  model.scores = scores_json(config, result, scores);
  write_json(out, to_json(model));
  print_identification(config, result, model, scores);
  fmt::print("\nwritten: {}\n", out.string());
  return model.status == Status::ok ? 0 : 1;
}

}  // namespace wheelhop
