#include "core/identify/residual_share.hpp"

#include <algorithm>
#include <numeric>
#include <vector>

#include "core/identify/judgements.hpp"

namespace wheelhop {

Vector residual_share(ConstMatrixRef residual, ConstMatrixRef u) {
  constexpr Index lags = kJudged.residual_lags;
  constexpr Index block = 512;  // samples whose regressors are held at once
  const Index m = u.rows(), p = residual.rows(), N = residual.cols() - lags;
  const Index regressors = lags + m * (lags + 1) + 1;
  if (N < 2 * regressors) return Vector::Zero(p);
  // Gram matrix of [own past of every output; inputs; 1; outputs now]: the regressions of all outputs are in it.
  const Index at_u = p * lags, at_one = at_u + m * (lags + 1), at_now = at_one + 1;
  Matrix gram = Matrix::Zero(at_now + p, at_now + p), rows(at_now + p, block);
  rows.row(at_one).setOnes();
  const Vector mean = residual.rowwise().mean();
  for (Index first = lags; first < residual.cols(); first += block) {
    const Index count = std::min(block, residual.cols() - first);
    for (Index l = 0; l <= lags; ++l) {
      rows.block(at_u + l * m, 0, m, count) = u.middleCols(first - l, count);
      rows.block(l == 0 ? at_now : (l - 1) * p, 0, p, count) = residual.middleCols(first - l, count).colwise() - mean;
    }
    gram.selfadjointView<Eigen::Lower>().rankUpdate(rows.leftCols(count));
  }
  gram = Matrix(gram.selfadjointView<Eigen::Lower>());
  Vector share = Vector::Zero(p);
  std::vector<Index> chosen(static_cast<std::size_t>(regressors));
  std::iota(chosen.begin() + lags, chosen.end(), at_u);
  for (Index i = 0; i < p; ++i) {
    for (Index l = 0; l < lags; ++l) chosen[static_cast<std::size_t>(l)] = l * p + i;
    // Normal equations with the columns at unit length: that a share is right to a few digits is all that is asked.
    const Vector per_length = gram.diagonal()(chosen).cwiseSqrt().cwiseMax(1e-300).cwiseInverse();
    Matrix own = per_length.asDiagonal() * gram(chosen, chosen) * per_length.asDiagonal();
    own.diagonal().array() += 1e-10;
    const Vector moments = per_length.asDiagonal() * gram(chosen, at_now + i);
    const double now = gram(at_now + i, at_now + i), sum = gram(at_one, at_now + i);
    const double total = now - sum * sum / static_cast<double>(N);
    const double left = now - moments.dot(solve(own, moments).col(0));
    const double freedom = static_cast<double>(N - 1) / static_cast<double>(N - regressors);
    if (total > 0) share(i) = std::max(0.0, 1 - freedom * left / total);
  }
  return share;
}

}  // namespace wheelhop
