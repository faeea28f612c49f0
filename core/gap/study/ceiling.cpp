#include "core/gap/study/ceiling.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "core/data/metrics.hpp"
#include "core/data/spectra.hpp"
#include "core/gap/where/forced.hpp"
#include "core/gap/where/probe.hpp"
#include "core/identify/map_fit.hpp"

namespace wheelhop {
namespace {

constexpr Index kIterations = 12;
constexpr double kGap = 0.1;          // misfit - 1, below which shares say nothing
constexpr double kForceRidge = 1e-5;  // of the mean response of a Newton, in power

/// (I - g g^+) z up to `band_hz`. @param r p x K @param sample_time_s of the record
Matrix without_response(const LinearPlant& linear, ConstVectorRef noise_std, ConstMatrixRef r, double sample_time_s,
                        double band_hz) {
  ComplexMatrix z = fft(faded(r));
  const Vector frequencies = fft_frequencies_hz(r.cols(), sample_time_s);
  for (Index k = 0; k < z.cols() && frequencies(k) <= band_hz; ++k) {
    const ComplexVector g = noise_std.cwiseInverse().asDiagonal() * force_response(linear, frequencies(k));
    const double size = g.squaredNorm();
    if (size > 0 && std::isfinite(size)) z.col(k) -= g * (g.dot(z.col(k)) / size);
  }
  return inverse_fft(z, r.cols());
}

/// Share of the noise below a frequency, mean over channels.
double noise_below(const ProfileOptions& noise, double frequency_hz) {
  const std::vector<double>& edges = noise.band_edges_hz;
  if (noise.noise_shares.size() == 0) return std::min(frequency_hz / edges.back(), 1.0);
  double sum = 0;
  for (std::size_t b = 0; b + 1 < edges.size(); ++b) {
    const double part = std::clamp((frequency_hz - edges[b]) / (edges[b + 1] - edges[b]), 0.0, 1.0);
    sum += part * noise.noise_shares.col(static_cast<Index>(b)).mean();
  }
  return sum;
}

/// f = weights' [phi(xi); xi; 1], xi the motion in units of its spread.
struct ScaledMap {
  std::shared_ptr<StaticMap> map;
  Vector middle, spread, weights;

  Matrix features(const Matrix& motion) const {
    const Matrix xi = spread.cwiseInverse().asDiagonal() * (motion.colwise() - middle);
    Matrix all(map->features() + 3, motion.cols());
    all << map->basis_of(xi).transpose(), xi, Matrix::Ones(1, motion.cols());
    return all;
  }
  std::vector<Vector> forces(const std::vector<Matrix>& motion) const {
    std::vector<Vector> list;
    for (const Matrix& own : motion) list.push_back(features(own).transpose() * weights);
    return list;
  }
};

/// Fits the forces at the inner samples of every record; without a map where that fails.
ScaledMap fit_map(const StaticMap& prototype, const std::vector<Matrix>& motion, const std::vector<Vector>& forces,
                  const std::vector<FitRecord>& records, const Solver& solver, Random& random) {
  std::vector<double> points, values;
  for (std::size_t i = 0; i < records.size(); ++i) {
    const Index skip = records[i].skip, fade = fade_samples(forces[i].size() - skip);
    for (Index k = skip + fade; k < forces[i].size() - fade; ++k) {
      points.insert(points.end(), {motion[i](0, k), motion[i](1, k)});
      values.push_back(forces[i](k));
    }
  }
  const auto count = static_cast<Index>(values.size());
  Matrix xi = Eigen::Map<Matrix>(points.data(), 2, count);
  const Eigen::RowVectorXd f = Eigen::Map<Eigen::RowVectorXd>(values.data(), count);
  ScaledMap map;
  map.middle = xi.rowwise().mean();
  xi.colwise() -= map.middle;
  map.spread = rms(xi).cwiseMax(1e-300);
  const double size = std::max(rms(f)(0), 1e-300);
  const MapFit fit =
      fit_static_map(prototype, map.spread.cwiseInverse().asDiagonal() * xi, f / size, {}, solver, random);
  map.map = fit.map;
  if (!fit.map) return map;
  map.weights.resize(fit.map->features() + 3);
  map.weights << fit.map->W.transpose(), (fit.map->L + fit.linear).transpose(), fit.map->b;
  map.weights *= size;
  return map;
}

/// The outputs of a record, over their noise, that a law's forces at the place make in the linearised plant.
/// @param forces one a row, h x N   @return h matrices p x K, those that are scored
std::vector<Matrix> outputs_of(const LinearPlant& linear, const FitRecord& record, const Matrix& forces,
                               double sample_time_s) {
  const ComplexMatrix F = fft(forces);
  const Vector frequencies = fft_frequencies_hz(forces.cols(), sample_time_s);
  ComplexMatrix G = ComplexMatrix::Zero(record.y.rows(), F.cols());
  for (Index k = 0; k < F.cols(); ++k) {
    const ComplexVector g = record.weight_std.cwiseInverse().asDiagonal() * force_response(linear, frequencies(k));
    if (g.allFinite()) G.col(k) = -g;
  }
  std::vector<Matrix> list;
  for (Index j = 0; j < F.rows(); ++j)
    list.push_back(inverse_fft(G * F.row(j).asDiagonal(), forces.cols()).rightCols(forces.cols() - record.skip));
  return list;
}

/// Weights by the error of the outputs, not of the force: what is near a resonance counts for more. Gauss-Newton with
/// the linearised plant's responses as long as the training records gain by it; no force where they never do.
void fit_weights(const LinearPlant& linear, const PlantFit& trained, const std::vector<FitRecord>& records,
                 const Place& location, const std::vector<Matrix>& motion, ScaledMap& map) {
  const Index count = map.weights.size();
  Index rows = 0;
  for (const FitRecord& record : records) rows += record.y.rows() * (record.y.cols() - record.skip);
  Matrix columns = Matrix::Zero(rows + count, count), gram = Matrix::Zero(count, count);
  rows = 0;
  for (std::size_t i = 0; i < records.size(); ++i) {
    const double sample_time_s = static_cast<double>(records[i].ratio) / trained.plant.hold_hz();
    const Matrix features = map.features(motion[i]);
    gram += features * features.transpose();
    const std::vector<Matrix> outputs = outputs_of(linear, records[i], features, sample_time_s);
    const Index length = outputs.front().size();
    for (Index j = 0; j < count; ++j)
      columns.col(j).segment(rows, length) = faded(outputs[static_cast<std::size_t>(j)]).reshaped();
    rows += length;
  }
  // What hardly shows in the outputs (a constant force, to accelerometers) is not to grow for it.
  const double ridge = kForceRidge * columns.squaredNorm() / gram.trace();
  columns.bottomRows(count) = std::sqrt(ridge) * Eigen::LLT<Matrix>(gram).matrixU().toDenseMatrix();
  const auto left_by = [&](const Vector& weights) {
    ScaledMap trial = map;
    trial.weights = weights;
    return residuals(force_at(trained, records, location, trial.forces(motion)));
  };
  Vector tried = map.weights, error(columns.rows());
  map.weights.setZero();
  double best = std::numeric_limits<double>::infinity();
  for (int step = 0; step <= kReconstructions; ++step) {
    const std::vector<Matrix> r = left_by(tried);
    const double misfit = inner_misfit(r);
    if (!(misfit < kWorthwhile * best)) break;
    best = misfit;
    map.weights = tried;
    error.setZero();
    Index first = 0;
    for (const Matrix& own : r) {
      error.segment(first, own.size()) = faded(own).reshaped();
      first += own.size();
    }
    tried -= least_squares(columns, error).x;
  }
  if (!(best < inner_misfit(left_by(Vector::Zero(count))))) map.weights.setZero();
}

Ceiling no_ceiling(const Place& location, const std::string& why_not) {
  Ceiling none;
  none.location = location;
  none.why_not = why_not;
  return none;
}

/// Of one plant. @param gap misfit - 1 before
Ceiling ceiling_of(const Plant& bare, const std::vector<FitRecord>& fitted, const std::vector<FitRecord>& held_out,
                   const Place& location, double gap, const CeilingPieces& pieces, const ProfileOptions& noise,
                   Random& random) {
  ForcePlace place;
  if (!force_place_of(bare, location, place))
    return no_ceiling(location, "what enters at \"" + to_string(location) + "\" is no force that a motion could make");
  const PlantFit trained = fit_plant(bare, {}, fitted, pieces.plant_solver, {kIterations, nullptr, false});
  const PlantFit tested = fit_plant(bare, {}, held_out, pieces.plant_solver, {kIterations, nullptr, false});
  if (trained.error.empty() || tested.error.empty()) return no_ceiling(location, "the plant cannot follow the drives");
  const LinearPlant linear = linearise_with_force(trained, place);
  if (linear.A.size() == 0) return no_ceiling(location, "no force can act there");
  const ForceReconstruction taught = reconstruct_force(trained, fitted, location);
  ForceReconstruction asked = reconstruct_force(tested, held_out, location);
  for (const std::string& why_not : {taught.why_not, asked.why_not})
    if (!why_not.empty()) return no_ceiling(location, why_not);

  Ceiling ceiling = no_ceiling(location, "");
  double freedom = 0;  // of p, that the signal takes from the noise, mean over the records
  for (std::size_t i = 0; i < held_out.size(); ++i) {
    const FitRecord& record = held_out[i];
    const double sample_time_s = static_cast<double>(record.ratio) / bare.hold_hz();
    const double band_hz = 0.4 / sample_time_s;  // all that a record tells: a sharp law reaches beyond the drive's band
    asked.left[i] = without_response(linear, record.weight_std, asked.left[i], sample_time_s, band_hz);
    freedom += noise_below(noise, band_hz) / static_cast<double>(held_out.size());
  }
  ceiling.signal = 1 - (inner_misfit(asked.left) - 1 + freedom / static_cast<double>(bare.sensor_count())) / gap;

  const std::vector<Matrix> motion = motion_at_place(taught.forced);
  ScaledMap map = fit_map(pieces.map, motion, taught.forces, fitted, pieces.map_solver, random);
  if (!map.map) return no_ceiling(location, "no map could be fitted");
  fit_weights(linear, trained, fitted, location, motion, map);
  ceiling.mapped = map.forces(motion_at_place(asked.forced));
  ceiling.static_map = 1 - (inner_misfit(residuals(force_at(tested, held_out, location, ceiling.mapped))) - 1) / gap;
  if (!std::isfinite(ceiling.static_map)) ceiling.why_not = "the plant cannot follow the map's force";
  return ceiling;
}

}  // namespace

Ceiling ceiling_at(const std::vector<Plant>& bare, const std::vector<FitRecord>& fitted,
                   const std::vector<FitRecord>& held_out, const Place& location, const PlantFit& before,
                   const CeilingPieces& pieces, const ProfileOptions& noise, Random& random) {
  std::vector<Matrix> without;
  for (std::size_t i = 0; i < before.error.size(); ++i)
    without.push_back(residual_of(before, held_out, i).rightCols(held_out[i].y.cols() - held_out[i].skip));
  const double gap = inner_misfit(without) - 1;
  if (!(gap > kGap)) return no_ceiling(location, "re-tuning leaves next to nothing to close");
  Ceiling best = no_ceiling(location, "no plant was given");
  for (const Plant& plant : bare) {
    Ceiling own = ceiling_of(plant, fitted, held_out, location, gap, pieces, noise, random);
    if (!own.why_not.empty() && &plant != &bare.front()) continue;
    if (!best.why_not.empty()) {
      best = std::move(own);
      continue;
    }
    best.signal = std::max(best.signal, own.signal);
    if (!(own.static_map > best.static_map)) continue;
    best.static_map = own.static_map;
    best.mapped = std::move(own.mapped);
  }
  return best;
}

}  // namespace wheelhop
