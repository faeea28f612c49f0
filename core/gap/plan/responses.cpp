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

/// The columns of one record for some sensors, scored samples x columns each: parameters, its own initial state,
/// candidates.
/// @param ran set to 0 where a candidate fails
bool columns_of(const Plant& plant, const std::vector<FitParameter>& parameters,
                const std::vector<EffectCandidate>& candidates, const Added& added, const FitRecord& record,
                const Vector& state_scale, const Vector& start, Index first, std::vector<Matrix>& columns,
                std::vector<char>& ran) {
  const Index tangents = static_cast<Index>(parameters.size()) + start.size(), sensors = record.y.rows();
  const Index kept = record.y.cols() - record.skip;
  for (Matrix& of_sensor : columns) of_sensor.setZero(kept, tangents + static_cast<Index>(candidates.size()));
  const auto put = [&](Index column, const Matrix& values) {
    for (std::size_t s = 0; s < columns.size(); ++s)
      columns[s].col(column) = values.row(first + static_cast<Index>(s)).transpose();
  };
  Vector base;
  if (!record_derivatives(plant, parameters, record, state_scale, start, base, put)) return false;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, candidates.size(), 1), [&](const auto& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      Vector there;
      if (plant_residual(extended(candidates[i].plant, added), {record}, {start}, there))
        put(tangents + static_cast<Index>(i), (there - base).reshaped(sensors, kept));
      else
        ran[i] = 0;
    }
  });
  return true;
}

}  // namespace

Plant extended(Plant plant, const Added& added) {
  plant.inputs.insert(plant.inputs.end(), added.inputs.begin(), added.inputs.end());
  plant.sensors.insert(plant.sensors.end(), added.sensors.begin(), added.sensors.end());
  return plant;
}

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

Responses responses(const Plant& plant, const std::vector<EffectCandidate>& candidates, const Added& added,
                    std::vector<FitRecord> records, double bytes, const SensorGram& take) {
  Responses out;
  const Plant whole = extended(plant, added);
  Vector state_scale;
  std::vector<Vector> start;
  out.status = nominal_outputs(whole, records, state_scale, start, out.message);
  if (out.status != Status::ok) return out;
  const std::vector<FitParameter> parameters = tolerance_parameters(whole);
  const Index states = state_scale.size(), sensors = whole.sensor_count();
  out.parameters = static_cast<Index>(parameters.size());
  const Index tangents = out.parameters + states * static_cast<Index>(records.size());
  const Index effects = static_cast<Index>(candidates.size());
  out.precision = Vector::Constant(tangents, 1 / (kStateSpread * kStateSpread));
  for (Index i = 0; i < out.parameters; ++i)
    out.precision(i) = 1 / std::pow(parameters[static_cast<std::size_t>(i)].prior_std, 2);
  out.ran.assign(candidates.size(), 1);
  Index longest = 0;
  for (const FitRecord& record : records) {
    out.samples += record.y.cols() - record.skip;
    longest = std::max(longest, record.y.cols() - record.skip);
  }
  const auto one =
      sizeof(double) * static_cast<double>(longest + tangents + effects) * static_cast<double>(tangents + effects);
  const Index at_once = std::clamp<Index>(static_cast<Index>(bytes / one), 1, sensors);
  for (Index first = 0; first < sensors; first += at_once) {
    const auto count = static_cast<std::size_t>(std::min(at_once, sensors - first));
    std::vector<Matrix> gram(count, Matrix::Zero(tangents + effects, tangents + effects)), columns(count);
    for (std::size_t r = 0; r < records.size(); ++r) {
      if (!columns_of(whole, parameters, candidates, added, records[r], state_scale, start[r], first, columns,
                      out.ran)) {
        out.status = Status::outside_domain;
        out.message = "the plant leaves the domain of its laws when a parameter moves";
        return out;
      }
      std::vector<Index> at(static_cast<std::size_t>(out.parameters + states + effects));
      std::iota(at.begin(), at.begin() + out.parameters, Index{0});
      std::iota(at.begin() + out.parameters, at.begin() + out.parameters + states,
                out.parameters + states * static_cast<Index>(r));
      std::iota(at.begin() + out.parameters + states, at.end(), tangents);
      tbb::parallel_for(std::size_t{0}, count,
                        [&](std::size_t s) { gram[s](at, at) += columns[s].transpose() * columns[s]; });
    }
    for (std::size_t s = 0; s < count; ++s) take(out, first + static_cast<Index>(s), gram[s]);
  }
  return out;
}

Visibility visibility(const Responses& responses, const Matrix& gram, Index divisor) {
  const Index tangents = responses.precision.size(), effects = static_cast<Index>(responses.ran.size());
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
