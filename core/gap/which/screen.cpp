#include "core/gap/which/screen.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <algorithm>

namespace wheelhop {
namespace {

/// Relative size below which what is left of a column after projection is round-off.
constexpr double kIndistinct = 1e-9;
// A judgement: a change so many times as large as what is left may say little of smaller ones.
constexpr double kLargeChange = 2;

/// Change of the residual that a candidate makes at its typical size. @return false if it cannot be simulated
bool change_of(const PlantFit& base, const std::vector<FitRecord>& records, const Plant& plant, Vector& change) {
  if (!plant_residual(plant, records, base.initial_states, change)) return false;
  change -= base.residual;
  return true;
}

/// The same, of a share of that size.
bool change_of_share(const PlantFit& base, const std::vector<FitRecord>& records, const EffectCandidate& candidate,
                     double share, Vector& change) {
  Plant plant = candidate.plant;
  const std::string& strength = candidate.parameters.front().name;
  set_parameter(plant, strength, candidate.ideal + share * (get_parameter(plant, strength) - candidate.ideal));
  if (!change_of(base, records, plant, change)) return false;
  change /= share;
  return true;
}

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
  // What is expected of a candidate, by the change that it makes; nothing of one that re-tuning makes as well.
  const auto expected = [&](std::size_t number, const Vector& change) {
    Screened own;
    own.candidate = number;
    const Vector common = base.layout.transposed_times(base.jacobian, change);
    const Vector followed = factor.solve(common);
    const double size = change.squaredNorm() - common.dot(followed);
    if (!(size > kIndistinct * change.squaredNorm())) return own;
    const double along = change.dot(base.residual);
    own.retuning = -followed.head(base.theta.size());
    own.strength = -along / size;
    if (own.strength > 0 || candidates[number].either_sign) own.gain = 0.5 * along * along / size;
    return own;
  };
  const double left = base.residual.norm();
  std::vector<Screened> list(candidates.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, candidates.size(), 1), [&](const auto& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      const EffectCandidate& candidate = candidates[i];
      list[i].candidate = i;
      Vector change;
      if (const auto before = known.find(keys[i]); before != known.end()) {
        list[i] = expected(i, before->second.cast<double>());
        continue;
      }
      if (!change_of(base, records, candidate.plant, change)) continue;
      list[i] = expected(i, change);
      // A nonlinear effect may change something else at a size at which its change is as large as the residual.
      const double share = left / change.norm();
      if (Vector smaller; share < 1 / kLargeChange && candidate.proportional && !candidate.parameters.empty() &&
                          change_of_share(base, records, candidate, share, smaller))
        if (const Screened own = expected(i, smaller); own.gain > list[i].gain) {
          list[i] = own;
          change = std::move(smaller);
        }
      if (found) simulated[i] = change.cast<float>();
    }
  });
  for (std::size_t i = 0; i < simulated.size(); ++i)
    if (simulated[i].size() > 0) found->emplace(keys[i], std::move(simulated[i]));
  std::stable_sort(list.begin(), list.end(), [](const Screened& a, const Screened& b) { return a.gain > b.gain; });
  return list;
}

}  // namespace wheelhop
