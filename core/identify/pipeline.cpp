#include "core/identify/pipeline.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>

#include "core/data/metrics.hpp"
#include "core/identify/free_run_problem.hpp"
#include "core/identify/input_matrices.hpp"

namespace wheelhop {
namespace {

Matrix stacked(ConstMatrixRef top, ConstMatrixRef bottom) {
  Matrix both(top.rows() + bottom.rows(), top.cols());
  both << top, bottom;
  return both;
}

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

/// Coordinates in which the states have unit covariance along the trajectory x.
void whiten(Extended& system, Matrix& x) {
  const Vector mean = x.rowwise().mean();
  const Matrix centred = x.colwise() - mean;
  const Matrix covariance = centred * centred.transpose() / static_cast<double>(x.cols());
  const Matrix root = symmetric_sqrt(covariance);
  const Matrix T = solve(root, Matrix::Identity(root.rows(), root.cols()));
  if (!all_finite(T)) return;
  system.linear = similarity_transform(system.linear, T);
  system.Bt = T * system.Bt;
  system.x0 = T * system.x0;
  x = T * x;
}

/// Unit covariance of f: f <- L^-1 f, [Bt; Dt] <- [Bt; Dt] L. Without it several auxiliary inputs drift into
/// near-collinear mixtures and the passes diverge.
void whiten_auxiliary(Extended& system, Matrix& f) {
  const Matrix covariance = f * f.transpose() / static_cast<double>(f.cols());
  const Matrix L = cholesky_lower(covariance);
  if (L.size() == 0) return;
  f = L.triangularView<Eigen::Lower>().solve(f);
  system.Bt = system.Bt * L;
  system.Dt = system.Dt * L;
}

}  // namespace

PipelineResult run_passes(ConstMatrixRef u, ConstMatrixRef y, double sample_time_s, const PipelineOptions& options,
                          const Pieces& pieces, Random& random) {
  const Index m = u.rows(), q = options.nonlinearities;
  PipelineResult result;
  result.linear = pieces.subspace.identify(u, y, options.order);  // step 1
  if (result.linear.status != Status::ok) {
    result.status = result.linear.status;
    result.message = "linear identification: " + result.linear.message;
    return result;
  }
  const Index n = result.linear.order_used;
  Extended system{result.linear.model, Matrix(), Matrix(), result.linear.x0};
  Matrix x_linear = simulate(system.linear, u, system.x0).x;
  system.Bt = Matrix::Zero(n, q);
  whiten(system, x_linear);
  result.linear.model = system.linear;
  result.linear.x0 = system.x0;

  const auto residual = [&] { return Matrix(y - simulate(system.linear, u, system.x0).y); };  // eqs. (12)-(13)
  if (options.direction == "input") {
    if (q > m) {
      result.status = Status::rank_deficient;
      result.message = "direction \"input\" offers as many directions as there are inputs";
      return result;
    }
    system.Bt = system.linear.B.leftCols(q);
    system.Dt = system.linear.D.leftCols(q);
    result.direction.status = Status::ok;
    result.direction.Bt = system.Bt;
    result.direction.Dt = system.Dt;
    result.direction.channel_residual = 0.05 * rms(residual());
  } else {
    DirectionOptions step2;
    step2.count = q;
    step2.direct_term = options.direct_term;
    result.direction = estimate_direction(system.linear.A, system.linear.C, residual(), sample_time_s, step2,
                                          pieces.solver, random);  // eq. (17)
    if (result.direction.status != Status::ok) {
      result.status = result.direction.status;
      result.message = "direction of the nonlinearity: " + result.direction.message;
      return result;
    }
    system.Bt = result.direction.Bt;
    system.Dt = result.direction.Dt;
  }

  for (Index number = 0; number < options.passes; ++number) {
    Pass pass;
    const Matrix z = residual();
    // What neither noise nor f explains; never below 1 % of the residual, so that R_v stays positive definite.
    const Vector noise_std = result.direction.channel_residual.cwiseMax(0.01 * rms(z)).cwiseMax(1e-6);
    Reconstruction inverse = pieces.inversion.reconstruct(system.linear.A, system.linear.C, system.Bt, system.Dt, z,
                                                          noise_std);  // step 3
    pass.status = inverse.status;
    pass.message = inverse.message;
    pass.input_variance = inverse.input_variance;
    if (inverse.status != Status::ok) {
      result.passes.push_back(std::move(pass));
      break;
    }
    Matrix f = std::move(inverse.f);
    whiten_auxiliary(system, f);
    LinearModel both = system.linear;
    both.B = Matrix(n, m + q);
    both.B << system.linear.B, system.Bt;
    both.D = Matrix(y.rows(), m + q);
    both.D << system.linear.D, system.Dt;
    Matrix x = simulate(both, stacked(u, f), system.x0).x;
    whiten(system, x);
    pass.split = decompose(x, u);

    MapFitOptions step4;
    step4.starts = number == 0 ? options.map_starts : 1;
    step4.iterations = options.map_iterations;
    const MapFit fit = fit_static_map(*pieces.make_map(n + m, q), stacked(x, u), f, step4, pieces.solver,
                                      random);  // step 4
    pass.status = fit.status;
    pass.message = fit.message;
    if (fit.status != Status::ok) {
      result.passes.push_back(std::move(pass));
      break;
    }
    pass.map_residual = fit.residual;
    pass.model = {system.linear, system.Bt, system.Dt, fit.map};
    fold_linear_part(pass.model, fit.linear);
    pass.x0 = system.x0;
    const FreeRun run = free_run(pass.model, u, pass.x0);
    pass.status = run.status;
    pass.training_vaf = vaf_percent(y, run.y);
    pass.score = run.status == Status::ok ? pass.training_vaf.mean() : -std::numeric_limits<double>::infinity();
    if (!std::isfinite(pass.score)) pass.score = -std::numeric_limits<double>::infinity();
    if (result.best < 0 || pass.score > result.passes[static_cast<std::size_t>(result.best)].score)
      result.best = static_cast<Index>(result.passes.size());

    if (number + 1 < options.passes) {  // step 5: the linear subsystem again, with f as further inputs
      Matrix f_hat(q, f.cols());
      Vector phi(fit.map->features());
      const Matrix xi = stacked(x, u);
      for (Index k = 0; k < f.cols(); ++k) fit.map->value(xi.col(k).data(), f_hat.col(k).data(), phi.data());
      const Matrix extended = stacked(u, f_hat);
      LinearEstimate again = pieces.subspace.identify(extended, y, n);
      if (again.status != Status::ok) {
        pass.message = "step 5: " + again.message;
        result.passes.push_back(std::move(pass));
        break;
      }
      if (!options.direct_term) {
        const InputMatrices restricted = estimate_input_matrices(again.model.A, again.model.C, extended, y, m);
        again.model = restricted.model;
        again.x0 = restricted.x0;
      }
      system = split_inputs(again.model, again.x0, m);
    }
    result.passes.push_back(std::move(pass));
  }
  if (result.best < 0) {
    result.status = result.passes.empty() ? Status::failed : result.passes.back().status;
    result.message =
        result.passes.empty() ? "no pass was made" : "no pass gave a model: " + result.passes.back().message;
    return result;
  }
  const Pass& best = result.passes[static_cast<std::size_t>(result.best)];
  result.model = best.model;
  result.x0 = best.x0;
  result.status = std::isfinite(best.score) ? Status::ok : Status::outside_domain;
  if (result.status != Status::ok) result.message = "the free run of every pass diverged on the training record";
  return result;
}

PipelineResult run_pipeline(const Signal& data, const PipelineOptions& options, const Pieces& pieces, Random& random) {
  Scaling scaling{rms(data.u), rms(data.y)};
  const Matrix u = scaling.u.cwiseInverse().asDiagonal() * data.u, y = scaling.y.cwiseInverse().asDiagonal() * data.y;
  PipelineResult result = run_passes(u, y, data.sample_time_s, options, pieces, random);
  result.scaling = std::move(scaling);
  if (result.status != Status::ok || options.refine_iterations == 0) return result;
  const Refinement refined = refine(result.model, result.x0, u, y, Vector::Ones(y.rows()), data.skip, pieces.solver,
                                    options.refine_iterations);
  result.refinement = refined.solution;
  if (refined.solution.status == Status::ok || refined.solution.status == Status::iteration_limit) {
    result.model = refined.model;
    result.x0 = refined.x0;
  }
  return result;
}

}  // namespace wheelhop
