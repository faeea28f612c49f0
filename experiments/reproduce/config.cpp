#include "experiments/reproduce/table.hpp"
#include "experiments/run/home.hpp"

namespace wheelhop {
namespace {

Json effective_with_printed(const ReproduceConfig& config) {
  Json out = effective_config(config);
  Json printed = config.printed_pieces.config();
  printed["pipeline"] = write_options(config.printed_pipeline);
  out["as_printed"] = std::move(printed);
  return out;
}

}  // namespace

ReproduceConfig parse_reproduce_config(const JsonCursor& cursor) {
  ReproduceConfig config;
  static_cast<ExperimentConfig&>(config) = parse_experiment_config(cursor);
  config.car = find_quarter_car(config.plant, cursor.at("plant").where());
  if (static_cast<Index>(config.outputs.size()) < config.plant.sensor_count())
    cursor.at("outputs").fail("all sensors of the plant");
  config.printed_pieces = config.pieces;
  config.printed_pipeline = config.pipeline;
  if (const auto printed = cursor.find("as_printed")) {
    config.printed_pieces = read_pieces(*printed, &config.pieces);
    config.printed_pipeline = read_pipeline(*printed, config.pipeline);
    if (config.printed_pipeline.nonlinearities == 0)
      printed->at("pipeline").at("nonlinearities").fail("at least 1, as linear and nonlinear models are compared here");
    printed->done();
  }
  config.printed_pipeline.refine_iterations = 0;  // the paper has no joint refinement
  cursor.done();
  config.effective = effective_with_printed(config);
  return config;
}

ReproduceConfig read_reproduce_config(const ReproduceRequest& request) {
  ReproduceConfig config = parse_reproduce_config(
      JsonCursor::load(request.config.empty() ? home() / "experiments" / "configs" / "paper.json" : request.config));
  config.preset = request.config.empty();
  if (request.realisations) config.data.realisations = *request.realisations;
  if (request.seed) config.data.seed = *request.seed;
  if (request.snr_db) config.data.snr_db = request.snr_db;
  config.effective = effective_with_printed(config);
  return config;
}

}  // namespace wheelhop
