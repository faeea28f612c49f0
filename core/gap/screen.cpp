#include "core/gap/screen.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <algorithm>

namespace wheelhop {
namespace {

/// Relative size below which what is left of a column after projection is round-off.
constexpr double kIndistinct = 1e-9;

}  // namespace

std::vector<Screened> screen(const PlantFit& base, const std::vector<FitRecord>& records,
                             const std::vector<EffectCandidate>& candidates) {
  Matrix H = base.jacobian.transpose() * base.jacobian;
  H.diagonal() += base.precision;
  const Eigen::LDLT<Matrix> factor(H);
  std::vector<Screened> list(candidates.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, candidates.size(), 1), [&](const auto& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      list[i].candidate = i;
      Vector change;
      if (!plant_residual(candidates[i].plant, records, base.initial_states, change)) continue;
      change -= base.residual;
      const Vector common = base.jacobian.transpose() * change;
      const double own = change.squaredNorm() - common.dot(factor.solve(common));
      if (!(own > kIndistinct * change.squaredNorm())) continue;
      const double along = change.dot(base.residual);
      list[i].strength = -along / own;
      if (list[i].strength > 0 || candidates[i].either_sign) list[i].gain = 0.5 * along * along / own;
    }
  });
  std::stable_sort(list.begin(), list.end(), [](const Screened& a, const Screened& b) { return a.gain > b.gain; });
  return list;
}

}  // namespace wheelhop
