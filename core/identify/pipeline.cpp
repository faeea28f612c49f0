#include "core/identify/pipeline.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "core/data/metrics.hpp"
#include "core/identify/free_run_problem.hpp"
#include "core/identify/input_matrices.hpp"

namespace wheelhop {
namespace {

constexpr Index kBlock = 256;  // samples at a time where a copy of a whole record would be made; steers no result

/// Linear system with the extended input [u; f] split into its two parts.
struct Extended {
  LinearModel linear;
  Matrix Bt, Dt;
  Vector x0;
};

Extended split_inputs(const LinearModel& both, const Vector& x0, Index m) {
  Extended result{both, both.B.rightCols(both.input_count() - m), both.D.rightCols(both.input_count() - m), x0};
  result.linear.B = both.B.leftCols(m);
  result.linear.D = both.D.leftCols(m);
  return result;
}

/// Coordinates in which the states have unit covariance on the samples [first, first + count) of the trajectory x.
void whiten(Extended& system, Matrix& x, Index first, Index count) {
  const Matrix root = symmetric_sqrt(covariance_of(x.middleCols(first, count)));
  const Matrix T = solve(root, Matrix::Identity(root.rows(), root.cols()));
  if (!all_finite(T)) return;
  system.linear = similarity_transform(system.linear, T);
  system.Bt = T * system.Bt;
  system.x0 = T * system.x0;
  for (Index at = 0; at < x.cols(); at += kBlock) {
    auto block = x.middleCols(at, std::min(kBlock, x.cols() - at));
    block = T * block;
  }
}

/// Unit covariance of f: f <- L^-1 f, [Bt; Dt] <- [Bt; Dt] L. Without it several auxiliary inputs drift into
/// near-collinear mixtures and the passes diverge.
void whiten_auxiliary(Extended& system, InputTrajectory& along) {
  const auto trusted = along.f.middleCols(along.first, along.count);
  const Matrix covariance = trusted * trusted.transpose() / static_cast<double>(along.count);
  const Matrix L = cholesky_lower(covariance);
  if (L.size() == 0) return;
  L.triangularView<Eigen::Lower>().solveInPlace(along.f);
  system.Bt = system.Bt * L;
  system.Dt = system.Dt * L;
}

/// What every step reads.
struct Run {
  ConstMatrixRef u, y;
  double sample_time_s;
  Index skip;  // samples at the start whose errors the refinements do not count
  const PipelineOptions& options;
  const Pieces& pieces;
  Random& random;
  OutputLimits limits = {};  // of the outputs

  Matrix residual(const Extended& system) const {  // eqs. (12)-(13)
    Matrix z = simulated_outputs(system.linear, u, system.x0);
    z -= y;
    excuse_beyond(limits, y, z);
    z = -z;
    return z;
  }
};

bool usable(const Solution& solution) {
  return solution.status == Status::ok || solution.status == Status::iteration_limit;
}

/// Step 1: linear model of [u, y], states whitened.
Extended identify_linear(const Run& run, PipelineResult& result) {
  result.linear = run.pieces.subspace.identify(run.u, run.y, run.options.order);
  if (result.linear.status != Status::ok) {
    result.status = result.linear.status;
    result.message = "linear identification: " + result.linear.message;
    return {};
  }
  Extended system{result.linear.model, Matrix::Zero(result.linear.order_used, run.options.nonlinearities), Matrix(),
                  result.linear.x0};
  const auto whiten_along = [&] {
    Matrix x = simulate(system.linear, run.u, system.x0).x;
    whiten(system, x, 0, x.cols());
  };
  whiten_along();
  if (run.options.linear_iterations > 0) {
    const Refinement refined =
        refine(without_map(system.linear, run.limits), system.x0, run.u, run.y, Vector::Ones(run.y.rows()), run.skip,
               run.pieces.solver, run.options.linear_iterations);
    result.output_error = refined.solution;
    if (usable(refined.solution) && spectral_radius(refined.model.linear.A) < 1) {
      system.linear = refined.model.linear;
      system.x0 = refined.x0;
      whiten_along();
      result.linear.spectral_radius = spectral_radius(system.linear.A);
    }
  }
  result.linear.model = system.linear;
  result.linear.x0 = system.x0;
  return system;
}

/// Step 2: [Bt; Dt] by eq. (17), or from physics.
void find_direction(const Run& run, Extended& system, PipelineResult& result) {
  const Index q = run.options.nonlinearities;
  Direction& direction = result.direction;
  if (run.options.direction == "input") {
    if (q > run.u.rows()) {
      result.status = direction.status = Status::rank_deficient;
      result.message = direction.message = "direction \"input\" offers as many directions as there are inputs";
      return;
    }
    direction.Bt = system.linear.B.leftCols(q);
    direction.Dt = run.options.direct_term ? Matrix(system.linear.D.leftCols(q)) : Matrix::Zero(run.y.rows(), q);
    // No estimate of what f cannot explain exists here; a twentieth keeps the inversion close to the residual.
    direction.channel_residual = 0.05 * rms(run.residual(system));
    direction.status = Status::ok;
  } else {
    DirectionOptions options;
    options.count = q;
    options.direct_term = run.options.direct_term;
    direction = estimate_direction(system.linear.A, system.linear.C, run.residual(system), run.sample_time_s, options,
                                   run.pieces.solver, run.random);
    if (direction.status != Status::ok) {
      result.status = direction.status;
      result.message = "direction of the nonlinearity: " + direction.message;
      return;
    }
  }
  system.Bt = direction.Bt;
  system.Dt = direction.Dt;
}

/// Step 3: f by dynamic inversion, then the states by simulating with the extended input (Sec. 2.6).
InputTrajectory reconstruct(const Run& run, Extended& system, const Vector& channel_residual, Pass& pass) {
  Matrix z = run.residual(system);
  // What neither noise nor f explains; never below 1 % of the residual, so that R_v stays positive definite.
  const Vector noise_std = channel_residual.cwiseMax(0.01 * rms(z)).cwiseMax(1e-6);
  Reconstruction inverse = without_delay(
      run.pieces.inversion.reconstruct(system.linear.A, system.linear.C, system.Bt, system.Dt, z, noise_std));
  z.resize(0, 0);
  pass.status = inverse.status;
  pass.message = inverse.message;
  pass.input_variance = inverse.input_variance;
  if (inverse.status != Status::ok) return {};
  InputTrajectory along{std::move(inverse.f), {}, inverse.first, inverse.last - inverse.first};
  if (along.count < 2 + run.u.rows() + 2 * system.linear.order()) {  // rows of eq. (4), and one step
    pass.status = Status::rank_deficient;
    pass.message = fmt::format("{} calls {} of {} samples trustworthy", run.pieces.inversion.name(),
                               std::max<Index>(along.count, 0), run.y.cols());
    return {};
  }
  whiten_auxiliary(system, along);
  LinearModel both = system.linear;
  both.B = Matrix(system.linear.order(), run.u.rows() + along.f.rows());
  both.B << system.linear.B, system.Bt;
  both.D = Matrix(run.y.rows(), both.B.cols());
  both.D << system.linear.D, system.Dt;
  along.x = simulate(both, stacked(run.u, along.f), system.x0).x;
  whiten(system, along.x, along.first, along.count);
  pass.split =
      decompose(along.x.middleCols(along.first, along.count), run.u.middleCols(along.first, along.count));  // eq. (4)
  return along;
}

/// Step 4: the static map from [x; u] to f, and the free run of the model that results.
void fit_map(const Run& run, const Extended& system, const InputTrajectory& along, Index starts, Pass& pass) {
  MapFitOptions options;
  options.starts = starts;
  options.budget = {run.options.map_iterations};
  const auto trusted = Eigen::seqN(along.first, along.count);
  const std::vector<Index> samples = chosen_samples(along.f(Eigen::all, trusted), options.samples);
  const Matrix f = along.f(Eigen::all, trusted)(Eigen::all, samples);
  const Matrix xi =
      stacked(along.x(Eigen::all, trusted)(Eigen::all, samples), run.u(Eigen::all, trusted)(Eigen::all, samples));
  const MapFit fit =
      fit_static_map(*run.pieces.make_map(xi.rows(), f.rows()), xi, f, options, run.pieces.solver, run.random);
  pass.status = fit.status;
  pass.message = fit.message;
  if (fit.status != Status::ok) return;
  pass.map_residual = fit.residual;
  pass.model = {system.linear, system.Bt, system.Dt, fit.map, run.limits};
  fold_linear_part(pass.model, fit.linear);
  pass.x0 = system.x0;
  Matrix y = Matrix::Zero(run.y.rows(), run.y.cols());
  const Index stopped_at = free_run_in_blocks(pass.model, run.u, pass.x0, [&](const FreeRunBlock& block) {
    y.middleCols(block.first, block.y.cols()) = block.y;
  });
  pass.status = stopped_at < 0 ? Status::ok : Status::outside_domain;
  pass.training_vaf = vaf_percent(run.y, y);
  const double mean = pass.training_vaf.mean();
  pass.score = pass.status == Status::ok && std::isfinite(mean) ? mean : -std::numeric_limits<double>::infinity();
}

/// Initial state of `model` from that of the trajectory x, whose states are other coordinates of nearly the same ones:
/// T x_0 with T by least squares of the model's states on x over the samples [first, first + inputs.cols()).
/// @param inputs of these samples   @param at_first state of the model at sample `first`
Vector initial_state_along(const LinearModel& model, ConstMatrixRef inputs, ConstVectorRef at_first, ConstMatrixRef x,
                           Index first) {
  const Matrix states = simulate(model, inputs, at_first).x;
  const auto same = x.middleCols(first, inputs.cols());
  return least_squares(same.transpose(), states.transpose()).x.transpose() * x.col(0);
}

/// Step 5: the linear subsystem again, with the map's f as further inputs, on the trustworthy samples. False if it
/// fails.
bool identify_extended(const Run& run, const InputTrajectory& along, Pass& pass, Extended& system) {
  const StaticMap& map = *pass.model.map;
  const Index m = run.u.rows();
  const auto u = run.u.middleCols(along.first, along.count), y = run.y.middleCols(along.first, along.count);
  const Index n = along.x.rows();
  Matrix extended(m + along.f.rows(), along.count);
  Vector xi(n + m), phi(map.features());
  for (Index k = 0; k < along.count; ++k) {
    extended.col(k).head(m) = u.col(k);
    xi << along.x.col(along.first + k), u.col(k);
    map.value(xi.data(), extended.col(k).data() + m, phi.data());
  }
  LinearEstimate again = run.pieces.subspace.identify(extended, y, system.linear.order());
  if (again.status != Status::ok) {
    pass.message = "step 5: " + again.message;
    return false;
  }
  if (!run.options.direct_term) {
    InputMatrices restricted = estimate_input_matrices(again.model.A, again.model.C, extended, y, m);
    again.model = std::move(restricted.model);
    again.x0 = std::move(restricted.x0);
  }
  if (along.first > 0) again.x0 = initial_state_along(again.model, extended, again.x0, along.x, along.first);
  system = split_inputs(again.model, again.x0, m);
  return true;
}

/// The pass with the best training free run becomes the result. Step 5 is not monotone.
void keep_best(PipelineResult& result) {
  for (std::size_t i = 0; i < result.passes.size(); ++i) {
    if (!result.passes[i].model.map) continue;
    if (result.best < 0 || result.passes[i].score > result.passes[static_cast<std::size_t>(result.best)].score)
      result.best = static_cast<Index>(i);
  }
  if (result.best < 0) {
    result.status = result.passes.back().status;
    result.message = "no pass gave a model: " + result.passes.back().message;
    return;
  }
  const Pass& best = result.passes[static_cast<std::size_t>(result.best)];
  result.model = best.model;
  result.x0 = best.x0;
  result.status = std::isfinite(best.score) ? Status::ok : Status::outside_domain;
  if (result.status != Status::ok) result.message = "the free run of every pass diverged on the training record";
}

/// Steps 3 and 4 once more from a refined model. The refinement is local and the map has many minima; the linear part
/// of a refined model is by then good enough for the inversion to hand a fresh map a far better f.
bool fit_map_anew(const Run& run, const NonlinearModel& refined, const Vector& x0, Pass& pass) {
  const Vector left = rms(run.y - free_run(refined, run.u, x0).y);
  Extended system{refined.linear, refined.Bt, refined.Dt, x0};
  // Most of what is left is the map's error, which f explains; a third stands for the rest.
  const InputTrajectory along = reconstruct(run, system, left / 3, pass);
  if (pass.status == Status::ok) fit_map(run, system, along, run.options.map_starts, pass);
  return pass.status == Status::ok;
}

/// The joint refinement of result.model, x0 (Sec. 2.6), in rounds against local minima of the map.
void refine_in_rounds(const Run& run, PipelineResult& result) {
  const Vector weight_std = Vector::Ones(run.y.rows());
  const auto refined_from = [&](const NonlinearModel& model, const Vector& x0, Index iterations) {
    return refine(model, x0, run.u, run.y, weight_std, run.skip, run.pieces.solver, iterations);
  };
  const auto keep = [&](const Refinement& refined) {
    result.model = refined.model;
    result.x0 = refined.x0;
  };
  double best = std::numeric_limits<double>::infinity();
  const auto short_refinement = [&](const NonlinearModel& model, const Vector& x0) {
    const Refinement refined = refined_from(model, x0, run.options.round_iterations);
    const bool better = usable(refined.solution) && refined.solution.cost < best;
    result.refinement.round_costs.push_back(usable(refined.solution) ? refined.solution.cost
                                                                     : std::numeric_limits<double>::infinity());
    if (!better) return;
    best = refined.solution.cost;
    keep(refined);
  };
  const auto ridge = [&] {
    return fit_ridge(result.model, result.x0, run.u, run.y, weight_std, run.skip, run.pieces.solver,
                     run.options.refine_iterations, run.pieces.make_ridge,
                     {.any = run.options.ridge_degree, .hardening = run.options.hardening_degree});
  };
  if (run.options.refine_rounds > 0) short_refinement(result.model, result.x0);
  // One element between two bodies needs no rounds: a map that bends in one direction, and one polynomial that does
  // better than it.
  std::optional<Refinement> simple;
  if (run.options.refine_rounds > 0) simple = ridge();
  Index idle = 0;  // rounds in a row that brought less than half a percent
  for (Index round = 0; !simple && round < run.options.refine_rounds && idle < 3; ++round) {
    const double before = best;
    Pass pass;
    if (!fit_map_anew(run, result.model, result.x0, pass)) break;
    short_refinement(pass.model, pass.x0);
    idle = best < 0.995 * before ? 0 : idle + 1;
  }
  if (!simple) simple = ridge();
  const Refinement last = simple ? *simple : refined_from(result.model, result.x0, run.options.refine_iterations);
  result.refinement.solution = last.solution;
  if (usable(last.solution)) keep(last);
}

/// The refinement of a model without a map.
void refine_linear(const Run& run, PipelineResult& result) {
  Refinement refined = refine(result.model, result.x0, run.u, run.y, Vector::Ones(run.y.rows()), run.skip,
                              run.pieces.solver, run.options.refine_iterations);
  result.refinement.solution = std::move(refined.solution);
  if (!usable(result.refinement.solution) || !(spectral_radius(refined.model.linear.A) < 1)) return;
  result.model = std::move(refined.model);
  result.x0 = std::move(refined.x0);
}

}  // namespace

PipelineResult run_passes(const SignalView& scaled, const PipelineOptions& options, const Pieces& pieces,
                          Random& random) {
  const Run run{scaled.u, scaled.y, scaled.sample_time_s, scaled.skip, options, pieces, random, scaled.limits};
  PipelineResult result;
  Extended system = identify_linear(run, result);
  if (result.linear.status != Status::ok) return result;
  if (options.nonlinearities == 0) {
    result.status = Status::ok;
    result.model = without_map(system.linear, run.limits);
    result.x0 = system.x0;
    return result;
  }
  find_direction(run, system, result);
  if (result.direction.status != Status::ok) return result;
  for (Index number = 0; number < options.passes; ++number) {
    Pass pass;
    InputTrajectory along = reconstruct(run, system, result.direction.channel_residual, pass);
    if (pass.status == Status::ok) fit_map(run, system, along, number == 0 ? options.map_starts : 1, pass);
    bool go_on = pass.model.map != nullptr;
    if (go_on && number + 1 < options.passes) go_on = identify_extended(run, along, pass, system);
    if (options.keep_trajectories) pass.along = std::move(along);
    result.passes.push_back(std::move(pass));
    if (!go_on) break;
  }
  keep_best(result);
  return result;
}

PipelineResult run_scaled_pipeline(const SignalView& scaled, const PipelineOptions& options, const Pieces& pieces,
                                   Random& random) {
  PipelineResult result = run_passes(scaled, options, pieces, random);
  if (result.status == Status::ok && options.refine_iterations > 0) {
    const Run run{scaled.u, scaled.y, scaled.sample_time_s, scaled.skip, options, pieces, random, scaled.limits};
    if (options.nonlinearities == 0)
      refine_linear(run, result);
    else
      refine_in_rounds(run, result);
  }
  return result;
}

PipelineResult run_pipeline(const Signal& data, const PipelineOptions& options, const Pieces& pieces, Random& random) {
  Scaling scaling{rms(data.u), rms(data.y)};
  Signal scaled = data;
  scaled.u = scaling.u.cwiseInverse().asDiagonal() * data.u;
  scaled.y = scaling.y.cwiseInverse().asDiagonal() * data.y;
  PipelineResult result = run_scaled_pipeline(scaled, options, pieces, random);
  result.scaling = std::move(scaling);
  return result;
}

}  // namespace wheelhop
