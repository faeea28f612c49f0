#include "core/gap/evidence/closure.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace wheelhop {
namespace {

constexpr Index kSmallSample = 3;  // blocks that a draw has less: few blocks scatter as Student's t says, not as normal
constexpr double kFewest = 0.02;   // share of the draws that an interval needs

}  // namespace

Vector block_misfits(ConstMatrixRef residual, Index block) {
  const Index N = residual.cols(), count = N == 0 ? 0 : std::max<Index>((N + block / 2) / block, 1);
  Vector misfits(count);
  for (Index b = 0; b < count; ++b) {
    const Index first = b * N / count, length = (b + 1) * N / count - first;
    misfits(b) = residual.middleCols(first, length).squaredNorm() / static_cast<double>(residual.rows() * length);
  }
  return misfits;
}

Closure closure(ConstVectorRef before, ConstVectorRef after, const Bootstrap& bootstrap) {
  Random random(bootstrap.seed, Stream::bootstrap);
  const auto share = [](double J_before, double J_after, double noise) {
    return 1 - (J_after - noise) / (J_before - noise);
  };
  Closure result{std::min(share(before.mean(), after.mean(), 1), 1.0)};
  if (!(before.mean() > 1)) {
    result.value = result.low = result.high = std::numeric_limits<double>::quiet_NaN();
    return result;
  }
  std::vector<double> shares;  // 1 for a draw that leaves less than its noise
  const Index blocks = before.size(), drawn = std::max<Index>(blocks - kSmallSample, 1);
  for (Index draw = 0; draw < bootstrap.draws; ++draw) {
    double J_before = 0, J_after = 0;
    for (Index b = 0; b < drawn; ++b) {
      const Index pick = std::min(static_cast<Index>(random.uniform() * static_cast<double>(blocks)), blocks - 1);
      J_before += before(pick) / static_cast<double>(drawn);
      J_after += after(pick) / static_cast<double>(drawn);
    }
    const double noise = 1 + bootstrap.floor_error * random.normal();
    if (J_before > noise) shares.push_back(std::min(share(J_before, J_after, noise), 1.0));
  }
  if (shares.empty()) return result;
  std::sort(shares.begin(), shares.end());
  const auto at = [&](double q, std::size_t count) { return shares[static_cast<std::size_t>(q * (count - 1.0))]; };
  // What lies below the floor cannot be: the lower end is that of the draws which can, of a few if they are few.
  const auto possible = static_cast<std::size_t>(std::lower_bound(shares.begin(), shares.end(), 1.0) - shares.begin());
  const auto fewest = static_cast<std::size_t>(kFewest * static_cast<double>(shares.size()));
  result.low = std::min(at(0.05, std::max({possible, fewest, std::size_t{1}})), result.value);
  result.high = std::max(at(0.95, shares.size()), result.value);
  return result;
}

}  // namespace wheelhop
