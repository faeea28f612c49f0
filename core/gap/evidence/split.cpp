#include "core/gap/evidence/split.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace wheelhop {
namespace {

constexpr Index kBlocksOfAThird = 3;
constexpr double kSignificant = 0.01;

/// Welch's t test as a two-sided p value; the quantile transformation of Student's t to a normal is Wallace's (1959).
double p_of_difference(const std::vector<double>& a, const std::vector<double>& b) {
  const auto moments = [](const std::vector<double>& x) {
    const auto n = static_cast<double>(x.size());
    double mean = 0, square = 0;
    for (const double value : x) mean += value / n;
    for (const double value : x) square += (value - mean) * (value - mean);
    return std::array<double, 3>{mean, square / (n - 1) / n, n};  // mean, variance of the mean, size
  };
  const auto [mean_a, var_a, n_a] = moments(a);
  const auto [mean_b, var_b, n_b] = moments(b);
  const double variance = var_a + var_b;
  if (!(variance > 0)) return mean_a == mean_b ? 1 : 0;
  const double t2 = (mean_a - mean_b) * (mean_a - mean_b) / variance;
  const double df = variance * variance / (var_a * var_a / (n_a - 1) + var_b * var_b / (n_b - 1));
  const double z = std::sqrt(df * std::log1p(t2 / df)) * (8 * df + 1) / (8 * df + 3);
  return std::erfc(z / std::sqrt(2.0));
}

double mean_of(const std::vector<double>& x) {
  double sum = 0;
  for (const double value : x) sum += value;
  return sum / static_cast<double>(x.size());
}

/// A quantity by blocks of the first and the last third.
struct Thirds {
  std::vector<double> first, last;
};

/// Offset, gain and lead of the error in a block: e = c0 + c1 y + c2 dy/dt.
Vector block_coefficients(ConstVectorRef e, ConstVectorRef y, ConstVectorRef y_rate) {
  Matrix regressors(e.size(), 3);
  regressors << Vector::Ones(e.size()), y, y_rate;
  return least_squares(regressors, e).x;
}

}  // namespace

Repeatability repeatability(const PlantFit& fit, const std::vector<FitRecord>& records, const NoiseFloor& floor) {
  Repeatability result;
  result.known = floor.source == FloorSource::repeats;
  if (!result.known) return result;
  const Index p = fit.plant.sensor_count();
  Vector repeats = Vector::Zero(p);
  double total = 0;
  for (std::size_t i = 0; i < records.size(); ++i) {
    const Index K = records[i].y.cols() - records[i].skip;
    repeats +=
        fit.error[i].rightCols(K).rowwise().squaredNorm() - static_cast<double>(K) * records[i].weight_std.cwiseAbs2();
    total += static_cast<double>(K);
  }
  repeats = (repeats / total).cwiseQuotient(floor.std.cwiseAbs2()).cwiseMax(0);  // over the variance between repeats
  result.channel = repeats.cwiseQuotient((repeats.array() + 1).matrix());
  result.share = repeats.sum() / (repeats.sum() + static_cast<double>(p));
  return result;
}

Drift drift(const PlantFit& fit, const std::vector<FitRecord>& records, Index block) {
  Drift result;
  const Index p = fit.plant.sensor_count();
  const double sample_time_s = static_cast<double>(records.front().ratio) / fit.plant.hold_hz();
  std::vector<Thirds> quantities(static_cast<std::size_t>(1 + 3 * p));
  for (std::size_t i = 0; i < records.size(); ++i) {
    const Index K = records[i].y.cols() - records[i].skip, blocks = K / block;
    if (blocks < 3 * kBlocksOfAThird) continue;
    const Matrix e = fit.error[i].rightCols(K), y = e + records[i].y.rightCols(K);
    const Vector level = (y.colwise() - y.rowwise().mean()).rowwise().norm() / std::sqrt(static_cast<double>(K));
    Matrix rate = Matrix::Zero(p, K);
    rate.middleCols(1, K - 2) = (y.rightCols(K - 2) - y.leftCols(K - 2)) / (2 * sample_time_s);
    for (Index b = 0; b < blocks; ++b) {
      const bool first = 3 * (b + 1) <= blocks, last = 3 * b >= 2 * blocks;
      if (!first && !last) continue;
      const auto note = [&](Index which, double value) {
        Thirds& thirds = quantities[static_cast<std::size_t>(which)];
        (first ? thirds.first : thirds.last).push_back(value);
      };
      const Index from = std::clamp<Index>(b * block, 1, K - 1 - block);  // no derivative at the ends
      note(0, (records[i].weight_std.cwiseInverse().asDiagonal() * e.middleCols(from, block)).squaredNorm() /
                  static_cast<double>(p * block));
      for (Index c = 0; c < p; ++c) {
        if (!(level(c) > 0)) continue;
        const Vector own =
            block_coefficients(e.row(c).segment(from, block).transpose(), y.row(c).segment(from, block).transpose(),
                               rate.row(c).segment(from, block).transpose());
        note(1 + 3 * c, own(0) / level(c));
        note(2 + 3 * c, own(1));
        note(3 + 3 * c, own(2));
      }
    }
  }
  if (quantities.front().first.size() < static_cast<std::size_t>(kBlocksOfAThird)) return result;
  result.known = true;
  const char* const kinds[] = {"offset", "gain", "phase"};
  for (std::size_t q = 0; q < quantities.size(); ++q) {
    if (quantities[q].first.empty()) continue;
    const double own = std::min(
        1.0, p_of_difference(quantities[q].first, quantities[q].last) * static_cast<double>(quantities.size()));
    if (q > 0 && own >= result.p) continue;
    result.p = own;
    result.kind = q == 0 ? "size" : kinds[(q - 1) % 3];
    result.channel = q == 0 ? "" : fit.plant.sensors[(q - 1) / 3].name;
    result.first = mean_of(quantities[q].first);
    result.last = mean_of(quantities[q].last);
  }
  result.significant = result.p < kSignificant;
  return result;
}

}  // namespace wheelhop
