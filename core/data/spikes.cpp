#include "core/data/spikes.hpp"

#include <algorithm>
#include <cmath>

namespace wheelhop {
namespace {

// Judgements. Normal noise reaches neither in a lifetime; what is missed is no worse off than without.
constexpr double kFar = 20, kFarAlone = 50;               // standard deviations of the interpolation error
constexpr double kQuiet = 6;                              // likewise, up to which another channel does not move
constexpr double kLeastBeside = 0.45, kMostBeside = 0.9;  // of the height, the error beside a spike; 2/3 without noise
constexpr Index kReach = 2;                               // samples on either side that the interpolation reads
constexpr Index kAround = 25;                             // samples on either side that are the neighbourhood
constexpr double kSame = 1e-9;                            // of the largest reading, by which equal ones differ
constexpr double kRounding = 0.4;                         // of a step: rounding, 1 / sqrt(12), interpolated
constexpr double kOfMedian = 1 / 0.6744897501960817;      // standard deviation over the median of |x|, normal

double median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Smallest difference of two samples in a row: the step of a converter, where there is one.
double step_of(ConstVectorRef y) {
  const double equal = kSame * y.cwiseAbs().maxCoeff();
  double step = 0;
  for (Index k = 1; k < y.size(); ++k)
    if (const double change = std::abs(y(k) - y(k - 1)); change > equal && (step == 0 || change < step)) step = change;
  return step;
}

Vector interpolation_error(ConstVectorRef y) {
  Vector e = Vector::Zero(y.size());
  for (Index k = kReach; k + kReach < y.size(); ++k)
    e(k) = y(k) - (4 * (y(k - 1) + y(k + 1)) - y(k - 2) - y(k + 2)) / 6;
  return e;
}

/// Standard deviation of the error around a sample, the samples that a spike there touches left out.
double spread_around(const Vector& e, Index k) {
  std::vector<double> values;
  for (Index i = std::max<Index>(k - kAround, 0); i <= std::min(k + kAround, e.size() - 1); ++i)
    if (std::abs(i - k) > kReach) values.push_back(std::abs(e(i)));
  return kOfMedian * median(values);
}

bool has_shape(const Vector& e, Index k) {
  const auto beside = [&](Index i) {
    const double ratio = -e(i) / e(k);
    return ratio > kLeastBeside && ratio < kMostBeside;
  };
  return beside(k - 1) && beside(k + 1);
}

}  // namespace

std::vector<SpikeAt> find_spikes(ConstMatrixRef y) {
  std::vector<SpikeAt> spikes;
  if (y.cols() <= 2 * kAround) return spikes;
  std::vector<Vector> errors;
  std::vector<double> spread;
  for (Index j = 0; j < y.rows(); ++j) {
    errors.push_back(interpolation_error(y.row(j).transpose()));
    std::vector<double> values;
    for (const double e : errors.back()) values.push_back(std::abs(e));
    // A converter leaves no smaller error than its rounding.
    spread.push_back(std::max(kOfMedian * median(values), kRounding * step_of(y.row(j).transpose())));
  }
  const double far = y.rows() > 1 ? kFar : kFarAlone;
  const auto at = [](Index j) { return static_cast<std::size_t>(j); };
  for (Index j = 0; j < y.rows(); ++j) {
    const Vector& e = errors[at(j)];
    // A channel that stands still has no spread to compare with.
    if (!(spread[at(j)] > 0)) continue;
    for (Index k = 2 * kReach; k + 2 * kReach < e.size(); ++k) {
      if (!(std::abs(e(k)) > far * spread[at(j)]) || !has_shape(e, k) || !(std::abs(e(k)) > far * spread_around(e, k)))
        continue;
      bool alone = true;
      for (Index i = 0; alone && i < y.rows(); ++i)
        if (i != j)
          alone = errors[at(i)].segment(k - kReach, 2 * kReach + 1).cwiseAbs().maxCoeff() <=
                  kQuiet * std::max(spread[at(i)], spread_around(errors[at(i)], k));
      if (alone) spikes.push_back({j, k, y(j, k) - e(k)});
    }
  }
  return spikes;
}

void bridge_spikes(RecordSet& set) {
  for (Record& record : set.records) {
    Matrix& y = record.signal.y;
    for (const SpikeAt& spike : find_spikes(y)) {
      set.spikes.push_back({record.file, record.signal.outputs[static_cast<std::size_t>(spike.channel)].name,
                            static_cast<double>(record.first + spike.sample) / set.sampling_hz,
                            y(spike.channel, spike.sample), spike.instead});
      y(spike.channel, spike.sample) = spike.instead;
    }
  }
}

}  // namespace wheelhop
