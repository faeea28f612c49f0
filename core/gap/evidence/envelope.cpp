#include "core/gap/evidence/envelope.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/plant/linearise.hpp"

namespace wheelhop {
namespace {

constexpr double kWorse = 0.1;  // of a closure, or of the floor where there was no gap

/// Time constant [s] of the plant's slowest oscillation, 0 if it has none.
double rings_on_s(const Plant& plant) {
  const LinearPlant linear = linearise(plant);
  double longest = 0;
  if (linear.A.size() > 0)
    for (const Mode& mode : modes(linear.A))
      if (mode.damping_ratio > 0 && mode.damping_ratio < 1) longest = std::max(longest, -1 / mode.pole.real());
  return longest;
}

Closure closure_of(const Matrix& before, const Matrix& after, Index block, const Bootstrap& bootstrap) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  if (before.cols() == 0) return {nan, nan, nan};
  return closure(block_misfits(before, block), block_misfits(after, block), bootstrap);
}

}  // namespace

MotionEnvelope motion_envelope(const std::vector<Trajectory>& motion, const std::vector<FitRecord>& records) {
  MotionEnvelope envelope;
  for (std::size_t i = 0; i < motion.size(); ++i) {
    const Matrix all = motion[i].stacked();
    const Matrix kept = all.rightCols(all.cols() - records[i].skip);
    const Vector low = kept.rowwise().minCoeff(), high = kept.rowwise().maxCoeff();
    envelope.low = i == 0 ? low : envelope.low.cwiseMin(low).eval();
    envelope.high = i == 0 ? high : envelope.high.cwiseMax(high).eval();
  }
  return envelope;
}

std::vector<char> outside_samples(const MotionEnvelope& envelope, const Trajectory& motion) {
  const Matrix all = motion.stacked();
  std::vector<char> outside;
  for (Index k = 0; k < all.cols(); ++k)
    outside.push_back((all.col(k).array() < envelope.low.array()).any() ||
                      (all.col(k).array() > envelope.high.array()).any());
  return outside;
}

BeyondEnvelope beyond_envelope(const PlantFit& before, const PlantFit& after, const std::vector<FitRecord>& records,
                               const MotionEnvelope& training, const std::vector<Trajectory>& motion, Index block,
                               const Bootstrap& bootstrap) {
  BeyondEnvelope result;
  const Index p = after.plant.sensor_count();
  const double sampling_hz = after.plant.hold_hz() / static_cast<double>(records.front().ratio);
  const auto ring = static_cast<Index>(std::ceil(std::min(rings_on_s(after.plant) * sampling_hz, 1e9)));
  std::vector<Index> columns[2];  // inside, outside, over all records
  Index total = 0;
  for (const FitRecord& record : records) total += record.y.cols() - record.skip;
  Matrix r_before(p, total), r_after(p, total);
  Vector beyond = Vector::Zero(training.low.size());
  const Vector width = (training.high - training.low).cwiseMax(std::numeric_limits<double>::min());
  Index first = 0;
  for (std::size_t i = 0; i < records.size(); ++i) {
    const FitRecord& record = records[i];
    const Index kept = record.y.cols() - record.skip;
    const Matrix weight = record.weight_std.cwiseInverse().asDiagonal();
    r_before.middleCols(first, kept) = weight * before.error[i].rightCols(kept);
    r_after.middleCols(first, kept) = weight * after.error[i].rightCols(kept);
    const std::vector<char> outside = outside_samples(training, motion[i]);
    Index rings_until = -1;
    for (Index k = record.skip; k < record.y.cols(); ++k) {
      if (outside[static_cast<std::size_t>(k)]) rings_until = k + ring;
      columns[k <= rings_until].push_back(first + k - record.skip);
    }
    const Matrix all = motion[i].stacked().rightCols(kept);
    beyond = beyond.cwiseMax((training.low - all.rowwise().minCoeff()).cwiseQuotient(width));
    beyond = beyond.cwiseMax((all.rowwise().maxCoeff() - training.high).cwiseQuotient(width));
    first += kept;
  }
  result.time_share = static_cast<double>(columns[1].size()) / static_cast<double>(total);
  const std::vector<std::string> names = trajectory_variables(after.plant);
  for (std::size_t v = 0; v < names.size(); ++v)
    if (const double by = beyond(static_cast<Index>(v)); by > 0) result.excursions.push_back({names[v], by});
  std::stable_sort(result.excursions.begin(), result.excursions.end(),
                   [](const Excursion& a, const Excursion& b) { return a.beyond > b.beyond; });
  const auto pick = [](const Matrix& r, const std::vector<Index>& which) { return Matrix(r(Eigen::all, which)); };
  result.inside = closure_of(pick(r_before, columns[0]), pick(r_after, columns[0]), block, bootstrap);
  result.outside = closure_of(pick(r_before, columns[1]), pick(r_after, columns[1]), block, bootstrap);
  result.flagged = result.outside.low < 0 || result.outside.value < result.inside.value - kWorse;
  if (std::isnan(result.outside.value) && !columns[1].empty())  // no gap there, unless the answer opens one
    result.flagged = pick(r_after, columns[1]).squaredNorm() >
                     (1 + kWorse) * static_cast<double>(p) * static_cast<double>(columns[1].size());
  return result;
}

}  // namespace wheelhop
