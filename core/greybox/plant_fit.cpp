#include "core/greybox/plant_fit.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <optional>

#include "core/data/slow_channels.hpp"
#include "core/greybox/inner_states.hpp"
#include "core/greybox/plant_problem.hpp"
#include "core/greybox/typical_states.hpp"
#include "core/optimise/bounded_step.hpp"
#include "core/optimise/prior.hpp"
#include "core/plant/dataset.hpp"
#include "core/plant/simulate.hpp"

namespace wheelhop {
namespace {

constexpr Index kVisited = 100;  // operating points a record

/// Initial states of the records of a fit. @param motions [q; v] of each, in the fit's scales
std::vector<InitialState> initial_states(const PlantFit& fit, const std::vector<FitRecord>& records,
                                         const Vector& motions) {
  std::vector<InitialState> list;
  const Index states = fit.state_scale.size();
  for (std::size_t i = 0; i < records.size(); ++i) {
    const Vector motion = motions.segment(states * static_cast<Index>(i), states);
    list.push_back(with_stored(fit.plant, records[i], Vector(motion.cwiseProduct(fit.state_scale))));
  }
  return list;
}

/// Initial states as a problem counts them: of each record [q; v], then its memories, in their scales.
Vector packed(const PlantFit& fit, const std::vector<InitialState>& list) {
  const Index motions = fit.state_scale.size(), memories = fit.memory_scale.size();
  Vector all((motions + memories) * static_cast<Index>(list.size()));
  Index filled = 0;
  for (const InitialState& state : list) {
    all.segment(filled, motions) = state.motion.cwiseQuotient(fit.state_scale);
    filled += motions;
    if (memories == 0) continue;
    all.segment(filled, memories) = memories_of(fit.plant, state).cwiseQuotient(fit.memory_scale);
    filled += memories;
  }
  return all;
}

/// Initial states that records tell are where these say, and stay there.
/// @param mean, start, precision as `packed`
void hold_known(const PlantFit& fit, const std::vector<FitRecord>& records, Vector& mean, Vector& start,
                Vector& precision) {
  const Index motions = fit.state_scale.size(), own = motions + fit.memory_scale.size();
  for (std::size_t i = 0; i < records.size(); ++i) {
    const Index first = own * static_cast<Index>(i);
    const auto hold = [&](Index state, double value) {
      mean(first + state) = start(first + state) = value;
      precision(first + state) = fit.dispersion / (kKnownSpread * kKnownSpread);
    };
    const Vector rest = fit.states_at_rest.segment(motions * static_cast<Index>(i), motions);
    for (const auto& [state, value] : known_states(fit.plant, records[i].start, rest.cwiseProduct(fit.state_scale)))
      hold(state, value / fit.state_scale(state));
    if (records[i].start.rest)
      for (Index state = motions; state < own; ++state) hold(state, mean(first + state));
  }
}

/// Adds operating points of a record, evenly over the samples that are scored.
void visit(const Simulation& result, const FitRecord& record, Matrix& visited) {
  const Index N = result.states.rows(), m = record.drive.rows(), scored = record.y.cols() - record.skip;
  const Index count = std::min(kVisited, scored), before = visited.cols();
  visited.conservativeResize(N + m, before + count);
  for (Index k = 0; k < count; ++k) {
    const Index sample = record.skip + k * scored / count;
    visited.col(before + k) << result.states.col(sample), record.drive.col(sample * record.ratio);
  }
}

/// What a solver finds; the problem as it stands where nothing can be moved, as of a plant without masses.
Solution solved(const Solver& solver, const ResidualProblem& problem, ConstVectorRef theta, Index iterations) {
  if (problem.parameters() > 0) return solver.minimise(problem, theta, iterations);
  Solution fixed;
  fixed.theta = theta;
  fixed.status = problem.cost(theta, fixed.cost) ? Status::ok : Status::outside_domain;
  return fixed;
}

Vector scored_residual(const std::vector<Matrix>& errors, const std::vector<FitRecord>& records) {
  Index total = 0, filled = 0;
  for (const FitRecord& record : records) total += record.y.rows() * (record.y.cols() - record.skip);
  Vector residual(total);
  for (std::size_t i = 0; i < records.size(); ++i) {
    const Index kept = records[i].y.cols() - records[i].skip, count = records[i].y.rows() * kept;
    residual.segment(filled, count).reshaped(records[i].y.rows(), kept) =
        records[i].weight_std.cwiseInverse().asDiagonal() * errors[i].rightCols(kept);
    filled += count;
  }
  return residual;
}

}  // namespace

std::vector<FitParameter> tolerance_parameters(const Plant& plant) {
  std::vector<FitParameter> list;
  for (const PlantParameter& parameter : plant_parameters(plant))
    if (parameter.value != 0 && !parameter.follows)
      list.push_back({parameter.name, parameter.tolerance * std::abs(parameter.value), 1});
  return list;
}

PlantFit fit_plant(const Plant& plant, const std::vector<FitParameter>& parameters,
                   const std::vector<FitRecord>& records, const Solver& solver, const FitOptions& options) {
  PlantFit fit;
  fit.plant = plant;
  std::vector<InitialState> begin, resting;
  if (options.from) {
    fit.state_scale = options.from->state_scale;
    fit.states_at_rest = options.from->states_at_rest;
    for (std::size_t i = 0; i < records.size(); ++i)
      begin.push_back(with_stored(plant, records[i], options.from->initial_states[i]));
    resting = initial_states(fit, records, fit.states_at_rest);
  } else if (const std::optional<TypicalStates> typical = typical_states(plant, records, solver)) {
    fit.state_scale = typical->scale;
    fit.states_at_rest = typical->rest;
    begin = initial_states(fit, records, typical->begin);
    resting = initial_states(fit, records, typical->rest);
  } else {
    fit.solution.status = Status::outside_domain;
    fit.solution.message = "the plant as delivered cannot follow the drive";
    return fit;
  }
  const bool same = options.from && inner_state_names(options.from->plant) == inner_state_names(plant);
  fit.memory_scale = same ? options.from->memory_scale : typical_inner_states(plant, records, begin);
  fit.dispersion = records.empty() ? 1 : records.front().dispersion;
  Vector rest = packed(fit, resting), start = packed(fit, begin);
  Vector state_precision = Vector::Constant(start.size(), fit.dispersion / (kStateSpread * kStateSpread));
  hold_known(fit, records, rest, start, state_precision);
  if (!options.from) {
    // The start of a record says little of the state there, and a wrong plant would bend it: it stays among those that
    // the drive makes.
    const PlantProblem states_alone(plant, {}, remembered_part(plant, records), fit.state_scale, fit.memory_scale);
    const Solution first = solved(solver, *with_prior(states_alone, start, state_precision), start, options.iterations);
    if (first.status != Status::outside_domain) start = first.theta;
  }
  const bool states_only = parameters.empty();
  PlantProblem problem(plant, parameters, states_only ? remembered_part(plant, records) : records, fit.state_scale,
                       fit.memory_scale);
  const Index moved = problem.moved();
  Vector theta(problem.parameters()), mean = Vector::Zero(problem.parameters());
  theta << (options.theta.size() == moved ? options.theta : Vector(Vector::Zero(moved))), start;
  theta = clamped(theta, problem.box());
  mean.tail(start.size()) = rest;
  fit.precision = Vector::Zero(problem.parameters());
  fit.precision.tail(start.size()) = state_precision;
  for (Index i = 0; i < moved; ++i) {
    const double std = parameters[static_cast<std::size_t>(i)].prior_std;
    if (std > 0) fit.precision(i) = fit.dispersion / (std * std);
  }
  if (options.alone) problem.run_alone();
  if (options.from && options.from->jacobian.size() > 0 && !states_only) problem.start_from(*options.from, theta);
  fit.solution = solved(solver, *with_prior(problem, mean, fit.precision), theta, options.iterations);
  if (fit.solution.status == Status::outside_domain) return fit;
  theta = fit.solution.theta;
  fit.theta = theta.head(moved);
  fit.deviation = theta - mean;
  move_parameters(fit.plant, parameters, fit.theta);
  for (std::size_t i = 0; i < records.size(); ++i) {
    const FitRecord& record = records[i];
    fit.initial_states.push_back(problem.initial_state(theta, i));
    Simulation result =
        simulate_measured(fit.plant, record.drive, run_options(fit.plant, record, fit.initial_states.back()));
    if (result.status != Status::ok) {
      fit.solution.status = result.status;
      fit.solution.message = result.message;
      fit.error.clear();
      return fit;
    }
    as_logged(record.slow, result.outputs);
    fit.error.push_back(result.outputs.leftCols(record.y.cols()) - record.y);
    visit(result, record, fit.visited);
  }
  fit.residual = scored_residual(fit.error, records);
  fit.misfit = fit.residual.squaredNorm() / static_cast<double>(fit.residual.size());
  if (options.linearise && !linearise(fit, parameters, records)) {
    fit.solution.status = Status::outside_domain;
    fit.solution.message = "linearisation failed at the solution";
    fit.error.clear();
  }
  return fit;
}

bool linearise(PlantFit& fit, const std::vector<FitParameter>& parameters, const std::vector<FitRecord>& records) {
  // About the fitted plant the parameters count from zero, in the same scales.
  const PlantProblem problem(fit.plant, parameters, records, fit.state_scale, fit.memory_scale);
  const Index moved = problem.moved();
  Vector theta(problem.parameters());
  theta << Vector::Zero(moved), packed(fit, fit.initial_states);
  fit.layout = problem.layout();
  fit.jacobian.resize(problem.residuals(), fit.layout.stored());
  if (!problem.stored_jacobian(theta, fit.residual, fit.jacobian)) return false;
  fit.covariance.resize(moved, moved);
  if (problem.parameters() == 0) return true;
  Matrix H = fit.layout.lower_gram(fit.jacobian);
  H.diagonal() += fit.precision;
  fit.covariance = Eigen::LDLT<Matrix, Eigen::Lower>(H)
                       .solve(Matrix::Identity(problem.parameters(), problem.parameters()))
                       .topLeftCorner(moved, moved) *
                   fit.dispersion;
  return true;
}

}  // namespace wheelhop
