#include "core/gap/evidence/profile.hpp"

#include <algorithm>
#include <cmath>

#include "core/data/metrics.hpp"
#include "core/data/spectra.hpp"
#include "core/gap/evidence/noise_floor.hpp"
#include "core/plant/linearise.hpp"

namespace wheelhop {
namespace {

constexpr double kNeighbours = 1.5, kApart = 4;  // ratios of modes
constexpr double kLinesInNarrowest = 4;          // of Welch's spectrum, in the lowest band
constexpr double kNextToNothing = 1.1;           // misfit
constexpr double kCrowded = 1.5, kOfNote = 0.1;
/// Bins of a variable: tenths of the time, the ends finer, where stops and lift-off are.
constexpr double kQuantiles[] = {0, 0.02, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.98, 1};

/// Scored residual of a record in units of its floor, p x K.
Matrix scored(const PlantFit& fit, const std::vector<FitRecord>& records, std::size_t i) {
  const Matrix r = records[i].weight_std.cwiseInverse().asDiagonal() * fit.error[i];
  return r.rightCols(r.cols() - records[i].skip);
}

template <class Part>
void share_out(std::vector<Part>& parts, std::size_t first, std::size_t last) {
  double total = 0;
  for (std::size_t i = first; i < last; ++i) total += std::max(parts[i].excess, 0.0);
  for (std::size_t i = first; i < last; ++i) parts[i].share = total > 0 ? std::max(parts[i].excess, 0.0) / total : 0;
}

std::size_t band_of(const std::vector<double>& edges, double f_hz) {
  const auto above = std::upper_bound(edges.begin() + 1, edges.end() - 1, f_hz);
  return static_cast<std::size_t>(above - edges.begin()) - 1;
}

/// Sum over Welch's segments of the power in each band, p x bands, in no particular unit.
Matrix band_power(ConstMatrixRef x, double sample_time_s, const std::vector<double>& edges) {
  const double wanted = kLinesInNarrowest / (edges[1] * sample_time_s);
  const Index length = std::clamp<Index>(static_cast<Index>(std::min(wanted, 1e9)), 1, x.cols());
  const Vector window = hann_window(length).cwiseMax(1e-3);  // a window of one sample is zero
  const Vector f = fft_frequencies_hz(length, sample_time_s);
  Matrix power = Matrix::Zero(x.rows(), static_cast<Index>(edges.size()) - 1);
  for (Index start = 0; start + length <= x.cols(); start += std::max<Index>(length / 2, 1)) {
    const ComplexMatrix X = fft(x.middleCols(start, length) * window.asDiagonal());
    for (Index k = 0; k < X.cols(); ++k)
      power.col(static_cast<Index>(band_of(edges, f(k)))) += (k == 0 || 2 * k == length ? 1 : 2) * X.col(k).cwiseAbs2();
  }
  return power;
}

void profile_bands(const std::vector<Matrix>& r, double sample_time_s, const ProfileOptions& options, Index total,
                   GapProfile& out) {
  const std::vector<double>& edges = options.band_edges_hz;
  const Index p = r.front().rows(), bands = static_cast<Index>(edges.size()) - 1;
  Matrix power = Matrix::Zero(p, bands);  // adds up to the misfit of each channel
  for (const Matrix& own : r) {
    Matrix part = band_power(own, sample_time_s, edges);
    for (Index i = 0; i < p; ++i)
      if (part.row(i).sum() > 0) power.row(i) += part.row(i) * own.row(i).squaredNorm() / part.row(i).sum();
  }
  power /= static_cast<double>(total);
  Matrix noise = options.noise_shares;
  if (noise.size() == 0) {
    noise.resize(p, bands);
    for (Index b = 0; b < bands; ++b)
      noise.col(b).setConstant((edges[static_cast<std::size_t>(b) + 1] - edges[static_cast<std::size_t>(b)]) /
                               edges.back());
  }
  const Matrix excess = power - noise;
  const Matrix positive = excess.cwiseMax(0);
  const Vector sums = positive.rowwise().sum();
  for (Index b = 0; b < bands; ++b) {
    BandShare band;
    band.from_hz = edges[static_cast<std::size_t>(b)];
    band.to_hz = edges[static_cast<std::size_t>(b) + 1];
    band.channel_excess = excess.col(b);
    band.excess = excess.col(b).mean();
    band.channel_share = (sums.array() > 0).select(positive.col(b).cwiseQuotient(sums), 0.0);
    out.bands.push_back(std::move(band));
  }
  share_out(out.bands, 0, out.bands.size());
}

/// @param values of one variable and @param power of r (mean over channels), at all scored samples
void profile_variable(const std::string& name, const std::vector<double>& values, const std::vector<double>& power,
                      GapProfile& out) {
  std::vector<double> sorted = values;
  std::sort(sorted.begin(), sorted.end());
  if (!(sorted.back() > sorted.front())) return;
  std::vector<double> edges;
  for (const double q : kQuantiles) {
    const double edge = sorted[static_cast<std::size_t>(std::llround(q * static_cast<double>(sorted.size() - 1)))];
    if (edges.empty() || edge > edges.back()) edges.push_back(edge);
  }
  const std::size_t first = out.regions.size();
  for (std::size_t b = 0; b + 1 < edges.size(); ++b) out.regions.push_back({name, edges[b], edges[b + 1]});
  const double one = 1 / static_cast<double>(values.size());
  for (std::size_t k = 0; k < values.size(); ++k) {
    RegionShare& region = out.regions[first + band_of(edges, values[k])];
    region.time_share += one;
    region.excess += one * (power[k] - 1);
  }
  share_out(out.regions, first, out.regions.size());
}

void profile_time(const std::vector<Matrix>& r, const std::vector<FitRecord>& records, double sample_time_s,
                  Index slices, Index total, GapProfile& out) {
  for (std::size_t i = 0; i < r.size(); ++i) {
    const Index K = r[i].cols(), parts = std::min(slices, K);
    for (Index s = 0; s < parts; ++s) {
      const Index from = s * K / parts, to = (s + 1) * K / parts;
      TimeShare slice{static_cast<Index>(i), static_cast<double>(from + records[i].skip) * sample_time_s,
                      static_cast<double>(to + records[i].skip) * sample_time_s};
      slice.excess = (r[i].middleCols(from, to - from).squaredNorm() / static_cast<double>(r[i].rows()) -
                      static_cast<double>(to - from)) /
                     static_cast<double>(total);
      out.time.push_back(slice);
    }
  }
  share_out(out.time, 0, out.time.size());
}

}  // namespace

std::vector<double> band_edges(const Plant& plant, double nyquist_hz) {
  std::vector<double> natural, edges = {0};
  const LinearPlant linear = linearise(plant);
  if (linear.A.size() > 0)
    for (const Mode& mode : modes(linear.A))
      if (mode.damping_ratio < 1 && mode.frequency_hz > 0) natural.push_back(mode.frequency_hz);
  const auto add = [&](double edge_hz) {
    const double unit = std::pow(10, std::floor(std::log10(edge_hz)) - 1);  // two digits are enough
    edge_hz = std::round(edge_hz / unit) * unit;
    if (edge_hz > edges.back() && edge_hz < 0.9 * nyquist_hz) edges.push_back(edge_hz);
  };
  for (std::size_t i = 0; i < natural.size(); ++i) {
    const double below = i == 0 ? 0 : natural[i - 1];
    if (i == 0 || natural[i] > kApart * below) {
      if (i > 0) add(2 * below);
      add(natural[i] / 2);
    } else if (natural[i] > kNeighbours * below) {
      add(std::sqrt(natural[i] * below));
    }
  }
  if (!natural.empty()) add(2 * natural.back());
  edges.push_back(nyquist_hz);
  return edges;
}

Matrix noise_shares(const RecordSet& set, const std::vector<double>& band_edges_hz) {
  Matrix power;
  for (const Repeats& group : repeats_of(set))
    for (const Matrix& noise : noise_of_repeats(group)) {
      const Matrix own = band_power(noise, group.front()->signal.sample_time_s, band_edges_hz);
      power = power.size() == 0 ? own : Matrix(power + own);
    }
  if (power.size() == 0 || !(power.rowwise().sum().minCoeff() > 0)) return {};
  return power.rowwise().sum().cwiseInverse().asDiagonal() * power;
}

GapProfile profile(const PlantFit& fit, const std::vector<FitRecord>& records, const std::vector<Trajectory>& motion,
                   const ProfileOptions& options) {
  GapProfile out;
  const Index p = fit.plant.sensor_count();
  const double sample_time_s = static_cast<double>(records.front().ratio) / fit.plant.hold_hz();
  std::vector<Matrix> r;
  std::vector<double> power;
  Vector error = Vector::Zero(p), level = error, noise = error;
  out.channel_misfit = Vector::Zero(p);
  Index total = 0;
  for (std::size_t i = 0; i < records.size(); ++i) {
    r.push_back(scored(fit, records, i));
    const Index K = r.back().cols();
    total += K;
    out.channel_misfit += r.back().rowwise().squaredNorm();
    error += fit.error[i].rightCols(K).rowwise().squaredNorm();
    level += records[i].y.rightCols(K).rowwise().squaredNorm();
    noise += static_cast<double>(K) * records[i].weight_std.cwiseAbs2();
    for (Index k = 0; k < K; ++k) power.push_back(r.back().col(k).squaredNorm() / static_cast<double>(p));
  }
  out.channel_misfit /= static_cast<double>(total);
  out.misfit = out.channel_misfit.mean();
  out.nrmse = error.cwiseQuotient(level).cwiseSqrt();
  out.floor_nrmse = noise.cwiseQuotient(level).cwiseSqrt();
  profile_bands(r, sample_time_s, options, total, out);
  profile_time(r, records, sample_time_s, options.slices, total, out);
  const std::vector<std::string> names = trajectory_variables(fit.plant);
  for (std::size_t v = 0; v < names.size(); ++v) {
    std::vector<double> values;
    for (std::size_t i = 0; i < records.size(); ++i) {
      const Matrix all = motion[i].stacked();
      for (Index k = records[i].skip; k < all.cols(); ++k) values.push_back(all(static_cast<Index>(v), k));
    }
    profile_variable(names[v], values, power, out);
  }
  return out;
}

bool has_gap(const GapProfile& profile) { return profile.misfit > kNextToNothing; }

std::vector<RegionShare> standing_out(const GapProfile& profile, std::size_t count) {
  std::vector<RegionShare> all;
  if (!has_gap(profile)) return all;
  for (const RegionShare& region : profile.regions)
    if (region.share >= kOfNote && region.share >= kCrowded * region.time_share) all.push_back(region);
  const auto weight = [](const RegionShare& r) { return r.share * std::log(r.share / r.time_share); };
  std::stable_sort(all.begin(), all.end(),
                   [&](const RegionShare& a, const RegionShare& b) { return weight(a) > weight(b); });
  std::vector<RegionShare> chosen;
  for (const RegionShare& region : all) {
    const auto same = [&](const RegionShare& other) { return other.variable == region.variable; };
    if (chosen.size() < count && std::count_if(chosen.begin(), chosen.end(), same) < 2) chosen.push_back(region);
  }
  return chosen;
}

}  // namespace wheelhop
