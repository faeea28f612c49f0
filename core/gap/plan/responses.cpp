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
constexpr Index kBlock = 256;       // columns whose products are formed at once: no result but its memory

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

/// Where the columns of one record stand among those of all: its own initial states between parameters and candidates.
std::vector<Index> places_of(Index parameters, Index states, Index tangents, Index effects, std::size_t record) {
  std::vector<Index> at(static_cast<std::size_t>(parameters + states + effects));
  const auto own = at.begin() + parameters, rest = own + states;
  std::iota(at.begin(), own, Index{0});
  std::iota(own, rest, parameters + states * static_cast<Index>(record));
  std::iota(rest, at.end(), tangents);
  return at;
}

/// Adds the products of some columns, from `from` on, with all others of one record and sensor.
/// @param at places of the columns, of which `tangents` are no candidates
void add_block(const Matrix& columns, const std::vector<Index>& at, Index tangents, Index from,
               const std::vector<CandidatePair>& pairs, Products& sum) {
  const Index count = std::min(kBlock, columns.cols() - from), first_candidate = std::max(from, tangents);
  const auto block = columns.middleCols(from, count);
  const Matrix common = columns.leftCols(tangents).transpose() * block;
  for (Index j = 0; j < count; ++j) {
    const Index place = at[static_cast<std::size_t>(from + j)];
    for (Index i = 0; i < tangents; ++i) sum.tangents(at[static_cast<std::size_t>(i)], place) += common(i, j);
  }
  const Index end = from + count;
  for (Index j = first_candidate; j < end; ++j) sum.squares(j - tangents) += columns.col(j).squaredNorm();
  if (pairs.empty() || first_candidate >= end) return;
  const Matrix products = columns.rightCols(columns.cols() - first_candidate).transpose() *
                          columns.middleCols(first_candidate, end - first_candidate);
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const Index a = tangents + pairs[k][0], b = tangents + pairs[k][1];
    if (b >= first_candidate && b < end)
      sum.pairs(static_cast<Index>(k)) += products(a - first_candidate, b - first_candidate);
  }
}

}  // namespace

void Products::add(const Products& other, double factor) {
  if (squares.size() == 0)
    *this = {Matrix::Zero(other.tangents.rows(), other.tangents.cols()), Vector::Zero(other.squares.size()),
             Vector::Zero(other.pairs.size())};
  tangents += factor * other.tangents;
  squares += factor * other.squares;
  pairs += factor * other.pairs;
}

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
                    std::vector<FitRecord> records, const ResponseRequest& request, const SensorProducts& take) {
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
  const Index here = out.parameters + states;  // tangents of one record
  const double one = sizeof(double) * (static_cast<double>(longest) * static_cast<double>(here + effects) +
                                       static_cast<double>(tangents) * static_cast<double>(tangents + effects) +
                                       static_cast<double>(request.pairs.size()));
  const Index at_once = std::clamp<Index>(static_cast<Index>(request.bytes / one), 1, sensors);
  const Products none{Matrix::Zero(tangents, tangents + effects), Vector::Zero(effects),
                      Vector::Zero(static_cast<Index>(request.pairs.size()))};
  const Index blocks = (here + effects + kBlock - 1) / kBlock;
  for (Index first = request.first_sensor; first < sensors; first += at_once) {
    const Index count = std::min(at_once, sensors - first);
    std::vector<Products> sums(static_cast<std::size_t>(count), none);
    std::vector<Matrix> columns(sums.size());
    for (std::size_t r = 0; r < records.size(); ++r) {
      if (!columns_of(whole, parameters, candidates, added, records[r], state_scale, start[r], first, columns,
                      out.ran)) {
        out.status = Status::outside_domain;
        out.message = "the plant leaves the domain of its laws when a parameter moves";
        return out;
      }
      const std::vector<Index> at = places_of(out.parameters, states, tangents, effects, r);
      tbb::parallel_for(Index{0}, count * blocks, [&](Index task) {
        const auto s = static_cast<std::size_t>(task / blocks);
        add_block(columns[s], at, here, task % blocks * kBlock, request.pairs, sums[s]);
      });
    }
    for (Index s = 0; s < count; ++s) take(out, first + s, sums[static_cast<std::size_t>(s)]);
  }
  return out;
}

Visibility visibility(const Responses& responses, const Products& products, const std::vector<CandidatePair>& pairs,
                      Index divisor) {
  const Index tangents = responses.precision.size(), effects = products.squares.size();
  Matrix H = products.tangents.leftCols(tangents);
  H.diagonal() += responses.precision;
  const Eigen::LDLT<Matrix> factor(H);
  const auto common = products.tangents.rightCols(effects);
  const Matrix followed = factor.solve(common);  // how parameters and initial states answer to each effect

  Visibility out;
  out.size.resize(effects);
  Vector length(effects);
  for (Index i = 0; i < effects; ++i) {
    const double left = products.squares(i) - common.col(i).dot(followed.col(i));
    length(i) = left > kRoundOff * products.squares(i) ? std::sqrt(left) : 0;
    out.size(i) = length(i) / std::sqrt(static_cast<double>(responses.samples * divisor));
    if (!responses.ran[static_cast<std::size_t>(i)]) out.size(i) = std::numeric_limits<double>::quiet_NaN();
  }
  out.cosine.resize(static_cast<Index>(pairs.size()));
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const auto [a, b] = pairs[k];
    const auto at = static_cast<Index>(k);
    const double left = products.pairs(at) - common.col(a).dot(followed.col(b)), size = length(a) * length(b);
    out.cosine(at) = size > 0 ? std::clamp(left / size, -1.0, 1.0) : 0.0;
  }
  const Matrix covariance =
      factor.solve(Matrix::Identity(tangents, tangents)).topLeftCorner(responses.parameters, responses.parameters);
  out.parameter_std = covariance.diagonal().cwiseMax(0).cwiseSqrt();
  out.parameter_cosine =
      out.parameter_std.cwiseInverse().asDiagonal() * covariance * out.parameter_std.cwiseInverse().asDiagonal();
  return out;
}

}  // namespace wheelhop
