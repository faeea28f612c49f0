#include "experiments/identify/identify.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdio>

#include "core/base/files.hpp"
#include "core/data/metrics.hpp"
#include "core/identify/free_run_problem.hpp"
#include "experiments/identify/study.hpp"
#include "experiments/run/file_uses.hpp"
#include "experiments/run/provenance.hpp"

namespace wheelhop {

Vector initial_state(const ModelFile& model, const Signal& record, Index samples) {
  return estimate_initial_state(model.model, Matrix(model.u_scale.cwiseInverse().asDiagonal() * record.u),
                                Matrix(model.y_scale.cwiseInverse().asDiagonal() * record.y), samples);
}

double radius_at_rest(const NonlinearModel& model) {
  if (!model.map) return spectral_radius(model.linear.A);
  const StaticMap& map = *model.map;
  const Index d = map.inputs(), h = map.features(), n = model.order();
  const Vector xi = Vector::Zero(d);
  Vector phi(h), w(h), by_xi(d), by_alpha(map.inner_parameters());
  map.basis(xi.data(), phi.data());
  Matrix slope = map.L;
  for (Index i = 0; i < map.outputs(); ++i) {
    w = map.W.row(i);
    map.slopes(xi.data(), phi.data(), w.data(), by_xi.data(), by_alpha.data());
    slope.row(i) += by_xi.transpose();
  }
  return spectral_radius(model.linear.A + model.Bt * slope.leftCols(n));
}

namespace {

ModelFile make_file(const IdentifyConfig& config, const PipelineResult& result) {
  ModelFile file;
  file.status = result.status;
  file.message = result.message;
  file.inputs = config.inputs;
  file.outputs = config.outputs;
  file.sampling_hz = config.set.sampling_hz;
  file.u_scale = result.scaling.u;
  file.y_scale = result.scaling.y;
  file.model = result.model;
  file.x0 = result.x0;
  file.config = config.effective;
  file.provenance = provenance(config.set);
  if (result.status != Status::ok) return file;
  const Signal& training = config.training();
  const FreeRun run = free_run(file, training.u, file.x0);
  file.envelope = {extremes_of(training.u), extremes_of(training.y), extremes_of(run.f)};
  if (const double radius = radius_at_rest(file.model); !(radius < 1)) {
    file.status = Status::unstable;
    file.message = fmt::format("the model is unstable at rest: largest pole modulus {:.6f}", radius);
  } else if (run.status != Status::ok) {
    file.status = run.status;
    file.message = fmt::format("the free run on the training record diverged at {:g} s",
                               static_cast<double>(run.stopped_at) * training.sample_time_s);
  }
  return file;
}

RecordScore score_record(const IdentifyConfig& config, const PipelineResult& result, const ModelFile& model,
                         std::size_t index) {
  const Record& record = config.set.records[index];
  const Signal& signal = record.signal;
  RecordScore score;
  score.file = record.file;
  score.role = record.role;
  score.first = record.first;
  score.samples = signal.samples();
  score.linear_vaf = run_and_score(without_map(result.linear.model), result.scaling, signal, signal.y,
                                   config.options.initial_state_samples)
                         .vaf;
  const bool trained = static_cast<Index>(index) == config.record_index;
  const FreeRun run = free_run(model, signal.u,
                               trained ? model.x0 : initial_state(model, signal, config.options.initial_state_samples));
  score.status = run.status;
  if (run.status != Status::ok) {
    score.message =
        fmt::format("the free run diverged at {:g} s", static_cast<double>(run.stopped_at) * signal.sample_time_s);
    return score;
  }
  score.vaf = vaf_percent(signal.y, run.y, signal.skip);
  score.rmse = rmse(signal.y, run.y, signal.skip);
  score.nrmse = nrmse(signal.y, run.y, signal.skip);
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

Json scores_json(const IdentifyConfig& config, const PipelineResult& result, const std::vector<RecordScore>& scores) {
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
      {"records", Json::array()}};
  for (const Pass& pass : result.passes)
    out["passes"].push_back(
        {{"status", std::string(to_string(pass.status))},
         {"message", pass.message},
         {"training_vaf_percent", std::vector<double>(pass.training_vaf.begin(), pass.training_vaf.end())}});
  for (std::size_t i = 0; i < scores.size(); ++i)
    out["records"].push_back(score_json(config, scores[i], static_cast<Index>(i) == config.record_index));
  return out;
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
  const Signal& training = config.training();
  if (!request.quiet)
    std::fprintf(stderr, "identifying from %s: %td samples, %td input(s), %td output(s)\n", config.record.c_str(),
                 training.samples(), training.input_count(), training.output_count());
  Random random(static_cast<std::uint64_t>(config.options.seed), Stream::initial_guess);
  const PipelineResult result =
      run_pipeline(training, config.pipeline, config.pieces.borrowed(config.pipeline), random);
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
  model.scores = scores_json(config, result, scores);
  write_json(out, to_json(model));
  print_identification(config, result, model, scores);
  fmt::print("\nwritten: {}\n", out.string());
  return model.status == Status::ok ? 0 : 1;
}

}  // namespace wheelhop
