#include "core/gap/which/screen.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <algorithm>

namespace wheelhop {
namespace {

/// Relative size below which what is left of a column after projection is round-off.
constexpr double kIndistinct = 1e-9;

}  // namespace

std::vector<std::string> keys_of(const std::vector<EffectCandidate>& candidates) {
  std::vector<std::string> keys;
  std::map<std::string, int> count;
  for (const EffectCandidate& candidate : candidates) {
    const std::string key = to_string(name_of(candidate)) + "/" + candidate.label().form;
    keys.push_back(key + "/" + std::to_string(count[key]++));
  }
  return keys;
}

std::vector<Screened> screen(const PlantFit& base, const std::vector<FitRecord>& records,
                             const std::vector<EffectCandidate>& candidates, const Changes& known, Changes* found) {
  const std::vector<std::string> keys = keys_of(candidates);
  std::vector<Eigen::VectorXf> simulated(found ? candidates.size() : 0);
  Matrix H = base.layout.gram(base.jacobian);
  H.diagonal() += base.precision;
  const Eigen::LDLT<Matrix> factor(H);
  std::vector<Screened> list(candidates.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, candidates.size(), 1), [&](const auto& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      list[i].candidate = i;
      Vector change;
      if (const auto before = known.find(keys[i]); before != known.end()) {
        change = before->second.cast<double>();
      } else {
        if (!plant_residual(candidates[i].plant, records, base.initial_states, change)) continue;
        change -= base.residual;
        if (found) simulated[i] = change.cast<float>();
      }
      const Vector common = base.layout.transposed_times(base.jacobian, change);
      const Vector followed = factor.solve(common);
      const double own = change.squaredNorm() - common.dot(followed);
      if (!(own > kIndistinct * change.squaredNorm())) continue;
      const double along = change.dot(base.residual);
      list[i].retuning = -followed.head(base.theta.size());
      list[i].strength = -along / own;
      if (list[i].strength > 0 || candidates[i].either_sign) list[i].gain = 0.5 * along * along / own;
    }
  });
  for (std::size_t i = 0; i < simulated.size(); ++i)
    if (simulated[i].size() > 0) found->emplace(keys[i], std::move(simulated[i]));
  std::stable_sort(list.begin(), list.end(), [](const Screened& a, const Screened& b) { return a.gain > b.gain; });
  return list;
}

}  // namespace wheelhop
