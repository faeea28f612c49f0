#include <chrono>
#include <cmath>
#include <limits>
#include <utility>

#include "core/data/metrics.hpp"
#include "experiments/experiment/records.hpp"
#include "experiments/reproduce/table.hpp"

namespace wheelhop {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

Beyond beyond_training(const ReproduceConfig& config, const SimulatedRecords& records) {
  Beyond beyond;
  std::vector<bool> outside(static_cast<std::size_t>(records.validation.samples()), false);
  for (std::size_t s = 0; s < 3; ++s) {
    const auto known = records.training.y.row(config.car->sensors[s]);
    const auto met = records.validation.y.row(config.car->sensors[s]);
    const double low = known.minCoeff(), high = known.maxCoeff();
    for (Index k = 0; k < met.size(); ++k)
      if (met(k) < low || met(k) > high) outside[static_cast<std::size_t>(k)] = true;
    const double distance = std::max({low - met.minCoeff(), met.maxCoeff() - high, 0.0});
    beyond.share_of_range[s] = distance > 0 ? distance / (high - low) : 0;
  }
  for (const bool flag : outside) beyond.samples += flag;
  return beyond;
}

ColumnScore score(const ReproduceConfig& config, const SimulatedRecords& records, const ScoredRun& run) {
  ColumnScore result{run.status, run.message, {}, {}};
  const Vector error =
      run.status == Status::ok ? rms(records.validation.y - run.y) : Vector::Constant(records.clean.rows(), infinity);
  for (std::size_t s = 0; s < 3; ++s) {
    const Index row = config.car->sensors[s];
    result.vaf_percent[s] = run.vaf(row);
    result.residual_over_noise[s] =
        config.data.snr_db ? error(row) / records.noise_std(row) : std::numeric_limits<double>::quiet_NaN();
  }
  return result;
}

ColumnScore failed_score(Status status, std::string message) {
  return {status, std::move(message), {-infinity, -infinity, -infinity}, {infinity, infinity, infinity}};
}

void compute_as_printed(const ReproduceConfig& config, const SimulatedRecords& records, RealisationRow& row) {
  ColumnScore& column = row.columns[static_cast<std::size_t>(Column::as_printed)];
  Random random = initial_guess(config, row.realisation);
  const PipelineResult result = run_pipeline(records.training, config.printed_pipeline,
                                             config.printed_pieces.borrowed(config.printed_pipeline), random);
  if (result.status != Status::ok) {
    column = failed_score(result.status, result.message);
    return;
  }
  column = score(config, records,
                 run_and_score(result.model, result.scaling, records.validation, records.clean,
                               config.data.initial_state_samples));
}

void compute_main(const ReproduceConfig& config, const SimulatedRecords& records, RealisationRow& row) {
  Random random = initial_guess(config, row.realisation);
  PipelineResult result =
      run_pipeline(records.training, config.pipeline, config.pieces.borrowed(config.pipeline), random);
  row.status = result.status;
  row.message = result.message;
  row.order = result.linear.order_used;
  row.gap = result.linear.gap;
  row.direction_residual = result.direction.residual;
  row.agreeing_starts = result.direction.agreeing;
  row.best_pass = result.best;
  row.refinement = std::move(result.refinement);
  const auto run = [&](Column column, const NonlinearModel& model) {
    ScoredRun scored =
        run_and_score(model, result.scaling, records.validation, records.clean, config.data.initial_state_samples);
    row.columns[static_cast<std::size_t>(column)] = score(config, records, scored);
    return scored;
  };
  std::array<ScoredRun, 3> runs;
  if (result.linear.status == Status::ok) runs[0] = run(Column::linear, without_map(result.linear.model));
  if (result.status == Status::ok) {
    runs[1] = run(Column::nonlinear, result.passes[static_cast<std::size_t>(result.best)].model);
    runs[2] = run(Column::refined, result.model);
    ColumnScore& refined = row.columns[static_cast<std::size_t>(Column::refined)];
    const Status outcome = row.refinement.solution.status;
    if (config.pipeline.refine_iterations == 0)
      refined = failed_score(Status::failed, "refine_iterations is 0");
    else if (outcome != Status::ok && outcome != Status::iteration_limit)
      refined = failed_score(outcome, "refinement: " + row.refinement.solution.message);
    const Vector Dt = result.scaling.y.asDiagonal() * result.model.Dt.leftCols(1);
    row.direct_ratio = Dt(config.car->sensors[1]) / Dt(config.car->sensors[2]);
    row.spring_r2 = runs[2].status == Status::ok ? spring_r2(records.plant, *config.car, records.validation.u,
                                                             records.validation_states, runs[2].f)
                                                 : std::numeric_limits<double>::quiet_NaN();
    std::array<Matrix, 3> lines;
    for (std::size_t s = 0; s < 3; ++s) {
      const Index sensor = config.car->sensors[s];
      lines[s].resize(4, records.validation.samples());
      lines[s] << records.validation.y.row(sensor), runs[0].y.row(sensor), runs[1].y.row(sensor), runs[2].y.row(sensor);
    }
    row.segment = find_segment(lines, records.validation.sample_time_s);
  }
  for (Pass& pass : result.passes) {  // a thousand realisations must not hold a thousand models
    pass.model = {};
    row.passes.push_back(std::move(pass));
  }
}

}  // namespace

RealisationRow compute_realisation(const ReproduceConfig& config, Index realisation) {
  RealisationRow row;
  row.realisation = realisation;
  row.direct_ratio = row.spring_r2 = std::numeric_limits<double>::quiet_NaN();
  row.columns.fill(failed_score(Status::failed, "not reached"));
  auto start = std::chrono::steady_clock::now();
  const auto lap = [&start] {
    const auto before = std::exchange(start, std::chrono::steady_clock::now());
    return std::chrono::duration<double>(start - before).count();
  };
  const SimulatedRecords records = simulate_records(config, realisation);
  row.status = records.status;
  row.message = records.message;
  if (records.status == Status::ok) {
    row.beyond = beyond_training(config, records);
    compute_main(config, records, row);
    row.seconds = lap();
    compute_as_printed(config, records, row);
    row.as_printed_seconds = lap();
  }
  return row;
}

}  // namespace wheelhop
