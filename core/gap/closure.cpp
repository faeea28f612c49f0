#include "core/gap/closure.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace wheelhop {

Vector block_misfits(ConstMatrixRef residual, Index block) {
  const Index count = (residual.cols() + block - 1) / block;
  Vector misfits(count);
  for (Index b = 0; b < count; ++b) {
    const Index length = std::min(block, residual.cols() - b * block);
    misfits(b) = residual.middleCols(b * block, length).squaredNorm() / static_cast<double>(residual.rows() * length);
  }
  return misfits;
}

Closure closure(ConstVectorRef before, ConstVectorRef after, Index draws, Random& random) {
  const auto share = [](double J_before, double J_after) { return 1 - (J_after - 1) / (J_before - 1); };
  Closure result{share(before.mean(), after.mean())};
  if (!(before.mean() > 1)) {
    result.value = result.low = result.high = std::numeric_limits<double>::quiet_NaN();
    return result;
  }
  std::vector<double> values;
  const Index blocks = before.size();
  for (Index draw = 0; draw < draws; ++draw) {
    double J_before = 0, J_after = 0;
    for (Index b = 0; b < blocks; ++b) {
      const Index pick = std::min(static_cast<Index>(random.uniform() * static_cast<double>(blocks)), blocks - 1);
      J_before += before(pick) / static_cast<double>(blocks);
      J_after += after(pick) / static_cast<double>(blocks);
    }
    if (J_before > 1) values.push_back(share(J_before, J_after));
  }
  std::sort(values.begin(), values.end());
  const auto quantile = [&](double q) {
    return values.empty() ? result.value : values[static_cast<std::size_t>(q * static_cast<double>(values.size() - 1))];
  };
  result.low = quantile(0.05);
  result.high = quantile(0.95);
  return result;
}

Vector rival_probabilities(ConstVectorRef misfits, Index blocks, double limit) {
  if (misfits.size() == 0) return {};
  const double best = misfits.minCoeff(), exponent = -0.5 * static_cast<double>(blocks);
  Vector p = (exponent * (misfits / best).array().log()).exp();
  return (p / p.sum()).cwiseMin(limit);
}

}  // namespace wheelhop
