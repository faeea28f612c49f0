#include "core/gap/plan/responses.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "core/data/metrics.hpp"
#include "core/plant/dataset.hpp"

namespace wheelhop {
namespace {

constexpr double kRoundOff = 1e-9;  // share of a column, below which what is left of it is none

/// The columns of one record: parameters, its own initial state, candidates.
/// @param ran set to 0 where a candidate fails
bool columns_of(const Plant& plant, const std::vector<FitParameter>& parameters,
                const std::vector<EffectCandidate>& candidates, const FitRecord& record, const Vector& state_scale,
                const Vector& start, Matrix& columns, std::vector<char>& ran) {
  const auto problem = plant_problem(plant, parameters, {record}, state_scale);
  const Index tangents = problem->parameters();
  Vector theta = Vector::Zero(tangents), base(problem->residuals());
  theta.tail(start.size()) = start.cwiseQuotient(state_scale);
  columns.setZero(base.size(), tangents + static_cast<Index>(candidates.size()));
  if (!problem->jacobian(theta, base, columns.leftCols(tangents))) return false;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, candidates.size(), 1), [&](const auto& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      Vector there;
      if (plant_residual(candidates[i].plant, {record}, {start}, there))
        columns.col(tangents + static_cast<Index>(i)) = there - base;
      else
        ran[i] = 0;
    }
  });
  return true;
}

}  // namespace

Status nominal_outputs(const Plant& plant, std::vector<FitRecord>& records, Vector& state_rms,
                       std::vector<Vector>& start, std::string& message) {
  const Index n2 = 2 * plant.mass_count();
  state_rms = Vector::Zero(n2);
  start.clear();
  for (FitRecord& record : records) {
    const Simulation run = simulate_measured(plant, record.drive, run_options(plant, record));
    message = run.message;
    if (run.status != Status::ok) return run.status;
    record.y = run.outputs;
    state_rms = state_rms.cwiseMax(rms(run.states.topRows(n2)));
    start.push_back(run.states.col(0).head(n2));
  }
  if (n2 == 0) return Status::ok;  // all nodes are held
  // A mass that never moves still needs a scale.
  state_rms = state_rms.cwiseMax(1e-9 + 1e-6 * state_rms.maxCoeff());
  return Status::ok;
}

Responses responses(const Plant& plant, const std::vector<EffectCandidate>& candidates,
                    std::vector<FitRecord> records) {
  Responses out;
  Vector state_scale;
  std::vector<Vector> start;
  out.status = nominal_outputs(plant, records, state_scale, start, out.message);
  if (out.status != Status::ok) return out;
  const std::vector<FitParameter> parameters = tolerance_parameters(plant);
  const Index states = state_scale.size(), sensors = plant.sensor_count();
  out.parameters = static_cast<Index>(parameters.size());
  const Index tangents = out.parameters + states * static_cast<Index>(records.size());
  const Index effects = static_cast<Index>(candidates.size());
  out.precision = Vector::Constant(tangents, 1 / (kStateSpread * kStateSpread));
  for (Index i = 0; i < out.parameters; ++i)
    out.precision(i) = 1 / std::pow(parameters[static_cast<std::size_t>(i)].prior_std, 2);
  out.gram.assign(static_cast<std::size_t>(sensors), Matrix::Zero(tangents + effects, tangents + effects));
  out.ran.assign(candidates.size(), 1);
  for (std::size_t r = 0; r < records.size(); ++r) {
    Matrix columns;
    if (!columns_of(plant, parameters, candidates, records[r], state_scale, start[r], columns, out.ran)) {
      out.status = Status::outside_domain;
      out.message = "the plant leaves the domain of its laws when a parameter moves";
      return out;
    }
    std::vector<Index> at(static_cast<std::size_t>(columns.cols()));
    std::iota(at.begin(), at.begin() + out.parameters, Index{0});
    std::iota(at.begin() + out.parameters, at.begin() + out.parameters + states,
              out.parameters + states * static_cast<Index>(r));
    std::iota(at.begin() + out.parameters + states, at.end(), tangents);
    const Index kept = columns.rows() / sensors;
    out.samples += kept;
    tbb::parallel_for(Index{0}, sensors, [&](Index i) {
      const Matrix own = columns(Eigen::seqN(i, kept, sensors), Eigen::all);
      out.gram[static_cast<std::size_t>(i)](at, at) += own.transpose() * own;
    });
  }
  return out;
}

Visibility visibility(const Responses& responses, const std::vector<Index>& sensors, double power, Index divisor) {
  const Index tangents = responses.precision.size(), effects = static_cast<Index>(responses.ran.size());
  Matrix gram = Matrix::Zero(tangents + effects, tangents + effects);
  for (const Index sensor : sensors) gram += power * responses.gram[static_cast<std::size_t>(sensor)];
  Matrix H = gram.topLeftCorner(tangents, tangents);
  H.diagonal() += responses.precision;
  const Eigen::LDLT<Matrix> factor(H);
  const Matrix common = gram.topRightCorner(tangents, effects), whole = gram.bottomRightCorner(effects, effects);
  Matrix left = whole - common.transpose() * factor.solve(common);
  left = (0.5 * (left + left.transpose())).eval();

  Visibility out;
  out.size.resize(effects);
  out.cosine = Matrix::Identity(effects, effects);
  Vector length(effects);
  for (Index i = 0; i < effects; ++i) {
    const bool something = left(i, i) > kRoundOff * whole(i, i);
    length(i) = something ? std::sqrt(left(i, i)) : 0;
    out.size(i) = length(i) / std::sqrt(static_cast<double>(responses.samples * divisor));
    if (!responses.ran[static_cast<std::size_t>(i)]) out.size(i) = std::numeric_limits<double>::quiet_NaN();
  }
  for (Index i = 0; i < effects; ++i)
    for (Index j = 0; j < i; ++j) {
      const double product = length(i) * length(j);
      out.cosine(i, j) = out.cosine(j, i) = product > 0 ? std::clamp(left(i, j) / product, -1.0, 1.0) : 0.0;
    }
  const Matrix covariance =
      factor.solve(Matrix::Identity(tangents, tangents)).topLeftCorner(responses.parameters, responses.parameters);
  out.parameter_std = covariance.diagonal().cwiseMax(0).cwiseSqrt();
  out.parameter_cosine =
      out.parameter_std.cwiseInverse().asDiagonal() * covariance * out.parameter_std.cwiseInverse().asDiagonal();
  return out;
}

}  // namespace wheelhop
