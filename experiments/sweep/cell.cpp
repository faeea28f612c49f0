#include "experiments/sweep/cell.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <set>

#include "core/data/metrics.hpp"
#include "core/identify/free_run_problem.hpp"
#include "core/kernels/hankel.hpp"
#include "experiments/experiment/records.hpp"

namespace wheelhop {
namespace {

constexpr Index kInstrumentRows = 20;  // block rows by which the instruments' correlation is measured
constexpr Index kMapSampleStep = 4;    // of the record, for the map fit that compares solvers

void put_status(Json& row, Status status, const std::string& message) {
  row["status"] = std::string(to_string(status));
  row["message"] = message;
}

/// Scores a model on the validation record: VAF in percent and RMSE in the output's unit against the outputs without
/// noise, as columns MODEL_vaf_OUTPUT and MODEL_rmse_OUTPUT.
ScoredRun put_scores(Json& row, const std::string& name, const ExperimentConfig& config,
                     const SimulatedRecords& records, const NonlinearModel& model, const Scaling& scaling) {
  ScoredRun run = run_and_score(model, scaling, records.validation, records.clean, config.data.initial_state_samples);
  const bool ran = run.status == Status::ok && run.y.cols() == records.clean.cols();
  const Vector error =
      ran ? rms(records.clean - run.y) : Vector::Constant(run.vaf.size(), std::numeric_limits<double>::infinity());
  for (Index i = 0; i < run.vaf.size(); ++i) {
    const std::string& output = records.validation.outputs[static_cast<std::size_t>(i)].name;
    row[fmt::format("{}_vaf_{}", name, output)] = run.vaf(i);
    row[fmt::format("{}_rmse_{}", name, output)] = error(i);
  }
  return run;
}

/// Correlation of what a linear model leaves of the future outputs with past inputs, and with past outputs beyond
/// those: 0 for valid instruments. Norms of blocks of the triangular factor of [1; U_f; U_p; Y_p; Z_f].
void put_instruments(Json& row, const Matrix& u, const Matrix& y, const Matrix& z) {
  const Index s = kInstrumentRows, m = u.rows(), p = y.rows(), known = 1 + m * s;
  if (u.cols() < known + (m + 2 * p) * s + 2 * s) return;
  const Matrix R = hankel_factor({{u, s, s}, {u, 0, s}, {y, 0, s}, {z, s, s}}).R;
  const Matrix left = R.bottomRightCorner(p * s, R.cols() - known);
  row["residual_correlation_past_inputs"] = left.leftCols(m * s).norm() / left.norm();
  row["residual_correlation_past_outputs"] = left.middleCols(m * s, p * s).norm() / left.norm();
}

void put_linear(Json& row, const LinearEstimate& linear, Status& status, std::string& message) {
  row["order"] = linear.order_used;
  row["gap"] = linear.gap;
  row["instruments"] = linear.instruments;
  row["instrument_condition"] = linear.instrument_condition;
  row["regression_condition"] = linear.condition;
  row["spectral_radius"] = linear.spectral_radius;
  row["stabilised"] = linear.stabilised;
  if (linear.status != Status::ok) {
    status = linear.status;
    message = "linear identification: " + linear.message;
  }
}

/// Step 1 and its score.
void measure_linear(const ExperimentConfig& config, const SimulatedRecords& records, Json& row) {
  const Scaling scaling{rms(records.training.u), rms(records.training.y)};
  const Matrix u = scaling.u.cwiseInverse().asDiagonal() * records.training.u;
  const Matrix y = scaling.y.cwiseInverse().asDiagonal() * records.training.y;
  const LinearEstimate linear = config.pieces.subspace.piece->identify(u, y, config.pipeline.order);
  Status status = Status::ok;
  std::string message;
  put_linear(row, linear, status, message);
  if (linear.status == Status::ok) {
    const ScoredRun run = put_scores(row, "linear", config, records, without_map(linear.model), scaling);
    status = run.status;
    message = run.message;
    put_instruments(row, u, y, y - simulate(linear.model, u, linear.x0).y);
  }
  put_status(row, status, message);
}

/// R^2 of f along the training record, where the inversion vouches for it; only the paper's car has its truth.
void put_inversion_r2(Json& row, const char* column, const ExperimentConfig& config, const SimulatedRecords& records,
                      const InputTrajectory& along) {
  if (!config.car) return;
  const auto part = [&](const Matrix& all) { return Matrix(all.middleCols(along.first, along.count)); };
  row[column] =
      spring_r2(records.plant, *config.car, part(records.training.u), part(records.training_states), part(along.f));
}

/// Steps 1 to 5 and the refinement, as far as the measure goes.
void measure_pipeline(const Grid& grid, const ExperimentConfig& config, const SimulatedRecords& records,
                      Index realisation, Json& row) {
  PipelineOptions options = config.pipeline;
  if (grid.measure != Measure::refined) options.refine_iterations = 0;
  if (grid.measure == Measure::inversion) options.passes = 1;
  options.keep_trajectories = true;
  Random random = initial_guess(config, realisation);
  const PipelineResult result = run_pipeline(records.training, options, config.pieces.borrowed(options), random);
  Status status = result.status;
  std::string message = result.message;
  put_linear(row, result.linear, status, message);
  if (options.linear_iterations > 0) {
    row["output_error_status"] = std::string(to_string(result.output_error.status));
    row["output_error_iterations"] = result.output_error.iterations;
  }
  if (result.linear.status == Status::ok)
    put_scores(row, "linear", config, records, without_map(result.linear.model), result.scaling);
  row["direction_residual"] = result.direction.residual;
  if (!result.passes.empty()) {
    const Pass& first = result.passes.front();
    const bool inverted = first.along.count > 0;
    if (grid.measure == Measure::inversion) status = inverted ? Status::ok : first.status;
    if (status == Status::ok) message.clear();
    if (!inverted) message = "inversion: " + first.message;
    row["trusted_share"] = static_cast<double>(first.along.count) / static_cast<double>(records.training.samples());
    if (inverted) put_inversion_r2(row, "inversion_r2", config, records, first.along);
    row["input_variance"] = first.input_variance;
    row["map_residual"] = first.map_residual;
  }
  if (grid.measure != Measure::inversion && result.status == Status::ok) {
    const Pass& best = result.passes[static_cast<std::size_t>(result.best)];
    row["best_pass"] = result.best + 1;
    put_inversion_r2(row, "best_pass_inversion_r2", config, records, best.along);
    const ScoredRun run = put_scores(row, "nonlinear", config, records, best.model, result.scaling);
    row["nonlinear_status"] = std::string(to_string(run.status));
    if (run.status != Status::ok && grid.measure == Measure::nonlinear)
      std::tie(status, message) = std::pair(run.status, run.message);
  }
  if (grid.measure == Measure::refined && result.status == Status::ok) {
    const ScoredRun run = put_scores(row, "refined", config, records, result.model, result.scaling);
    row["map"] = result.model.map->name();
    row["map_parameters"] = result.model.map->parameters();
    const Solution& solution = result.refinement.solution;
    row["refine_status"] = std::string(to_string(solution.status));
    row["refine_iterations"] = solution.iterations;
    row["refine_evaluations"] = solution.evaluations.total();
    row["refine_cost"] = solution.cost;
    if (run.status != Status::ok) std::tie(status, message) = std::pair(run.status, run.message);
  }
  put_status(row, status, message);
}

bool usable(const Solution& solution) {
  return solution.status == Status::ok || solution.status == Status::iteration_limit;
}

void put_solution(Json& row, const std::string& problem, double start, const Solution& solution) {
  row[problem + "_start_cost"] = start;
  if (usable(solution)) row[problem + "_cost"] = solution.cost;
  row[problem + "_status"] = std::string(to_string(solution.status));
  row[problem + "_message"] = solution.message;
  row[problem + "_evaluations"] = solution.evaluations.total();
  row[problem + "_linearisations"] = solution.evaluations.linearisations;
}

/// The cell's solver on two problems that the base's pieces prepare: the fit of a freshly drawn map to the first pass's
/// f, and the joint refinement of the best pass.
void measure_solver(const Grid& grid, const ExperimentConfig& config, const SimulatedRecords& records,
                    Index realisation, Json& row) {
  PipelineOptions options = grid.base.pipeline;
  options.refine_iterations = 0;
  options.keep_trajectories = true;
  Random random = initial_guess(grid.base, realisation);
  const Pieces pieces = grid.base.pieces.borrowed(options);
  const PipelineResult start = run_pipeline(records.training, options, pieces, random);
  if (start.status != Status::ok) {
    put_status(row, start.status, "preparation: " + start.message);
    return;
  }
  const Matrix u = start.scaling.u.cwiseInverse().asDiagonal() * records.training.u;
  const Matrix y = start.scaling.y.cwiseInverse().asDiagonal() * records.training.y;
  const InputTrajectory& along = start.passes.front().along;
  const auto every = Eigen::seqN(along.first, along.count / kMapSampleStep, kMapSampleStep);
  Matrix xi(along.x.rows() + u.rows(), every.size());
  xi << along.x(Eigen::all, every), u(Eigen::all, every);
  const Matrix f = along.f(Eigen::all, every);
  const auto map = pieces.make_map(xi.rows(), f.rows());
  if (xi.cols() < map->features() + 1 + xi.rows() + f.rows()) {
    put_status(row, Status::rank_deficient, fmt::format("preparation: {} samples are too few for the map", xi.cols()));
    return;
  }
  map->initialise(xi, f, random);
  const Solver& solver = *config.pieces.solver.piece;
  const Budget budget{Budget::kUnlimited, grid.evaluations};

  const auto fit = map_problem(*map, xi, f);
  double cost = 0;
  static_cast<void>(fit->cost(map->alpha, cost));
  const Solution of_map = solver.minimise(*fit, map->alpha, budget);
  put_solution(row, "map", cost, of_map);
  const auto joint = free_run_problem(start.model, u, y, Vector::Ones(y.rows()), records.training.skip);
  const Vector theta = pack(start.model, start.x0);
  static_cast<void>(joint->cost(theta, cost));
  const Solution of_joint = solver.minimise(*joint, theta, budget);
  put_solution(row, "joint", cost, of_joint);
  const Solution& worse = usable(of_map) ? of_joint : of_map;
  put_status(row, usable(worse) ? Status::ok : worse.status, usable(worse) ? "" : worse.message);
}

}  // namespace

bool is_row_column(const std::string& name) {
  static const std::set<std::string> columns = {
      // every row
      "cell", "realisation", "seed", "config_hash", "status", "message",
      // step 1
      "order", "gap", "instruments", "instrument_condition", "regression_condition", "spectral_radius", "stabilised",
      "residual_correlation_past_inputs", "residual_correlation_past_outputs", "output_error_status",
      "output_error_iterations",
      // the passes
      "direction_residual", "trusted_share", "inversion_r2", "input_variance", "map_residual", "best_pass",
      "best_pass_inversion_r2", "nonlinear_status",
      // the refinement
      "map", "map_parameters", "refine_status", "refine_iterations", "refine_evaluations", "refine_cost"};
  if (columns.contains(name)) return true;
  for (const char* prefix : {"linear_", "nonlinear_", "refined_"})
    for (const char* kind : {"vaf_", "rmse_"})
      if (name.starts_with(std::string(prefix) + kind)) return true;
  for (const char* problem : {"map_", "joint_"})
    for (const char* member : {"start_cost", "cost", "status", "message", "evaluations", "linearisations"})
      if (name == std::string(problem) + member) return true;
  return false;
}

Json compute_row(const Grid& grid, std::size_t cell, Index realisation) {
  const ExperimentConfig config = grid.config_of(cell);
  Json row = {{"cell", cell}, {"realisation", realisation}};
  for (std::size_t i = 0; i < grid.axes.size(); ++i) row[grid.axes[i].name] = grid.value(cell, i);
  row["seed"] = config.data.seed;
  row["config_hash"] = row_hash(grid, cell, realisation);
  put_status(row, Status::failed, "not reached");
  try {
    const SimulatedRecords records = simulate_records(config, realisation);
    if (records.status != Status::ok)
      put_status(row, records.status, records.message);
    else if (grid.measure == Measure::linear)
      measure_linear(config, records, row);
    else if (grid.measure == Measure::solver)
      measure_solver(grid, config, records, realisation, row);
    else
      measure_pipeline(grid, config, records, realisation, row);
  } catch (const MachineError&) {
    throw;
  } catch (const UserError& error) {  // options that fit no data of this size
    put_status(row, Status::failed, error.what());
  }
  return row;
}

}  // namespace wheelhop
