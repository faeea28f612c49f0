#include "core/data/lost_samples.hpp"

#include <algorithm>

namespace wheelhop {
namespace {

/// Value at `place` of the polynomial through columns [first, last) of `samples`, which stand at `places`.
Vector polynomial_at(ConstMatrixRef samples, const std::vector<Index>& places, Index first, Index last, Index place) {
  Vector value = Vector::Zero(samples.rows());
  for (Index i = first; i < last; ++i) {
    double weight = 1;
    for (Index j = first; j < last; ++j)
      if (j != i)
        weight *= static_cast<double>(place - places[static_cast<std::size_t>(j)]) /
                  static_cast<double>(places[static_cast<std::size_t>(i)] - places[static_cast<std::size_t>(j)]);
    value += weight * samples.col(i);
  }
  return value;
}

}  // namespace

Matrix bridge(ConstMatrixRef samples, const std::vector<LostSamples>& lost) {
  const Index n = samples.cols();
  std::vector<Index> places;
  Index missing = 0;
  auto next = lost.begin();
  for (Index k = 0; k < n; ++k) {
    if (next != lost.end() && next->before == k) missing += (next++)->count;
    places.push_back(k + missing);
  }
  Matrix whole(samples.rows(), n + missing);
  for (Index k = 0; k < n; ++k) whole.col(places[static_cast<std::size_t>(k)]) = samples.col(k);
  for (const LostSamples& gap : lost) {
    const Index behind = places[static_cast<std::size_t>(gap.before)];
    for (Index place = behind - gap.count; place < behind; ++place)
      whole.col(place) =
          polynomial_at(samples, places, std::max<Index>(gap.before - 2, 0), std::min<Index>(gap.before + 2, n), place);
  }
  return whole;
}

std::pair<Index, Index> longest_whole(Index samples, const std::vector<LostSamples>& lost) {
  std::pair<Index, Index> best{0, 0};
  Index first = 0;
  const auto end_at = [&](Index end) {
    if (end - first > best.second) best = {first, end - first};
    first = end;
  };
  for (const LostSamples& gap : lost) end_at(gap.before);
  end_at(samples);
  return best;
}

}  // namespace wheelhop
