#include "core/identify/residual_share.hpp"

#include <algorithm>

namespace wheelhop {

Vector residual_share(ConstMatrixRef residual, ConstMatrixRef u) {
  constexpr Index lags = 10;  // judgement: more than a model error of one mode needs
  const Index m = u.rows(), p = residual.rows(), N = residual.cols() - lags;
  const Index regressors = lags + m * (lags + 1) + 1;
  Vector share = Vector::Zero(p);
  if (N < 2 * regressors) return share;
  Matrix rows(regressors, N);
  rows.bottomRows(1).setOnes();
  for (Index l = 0; l <= lags; ++l) rows.middleRows(lags + l * m, m) = u.middleCols(lags - l, N);
  for (Index i = 0; i < p; ++i) {
    for (Index l = 1; l <= lags; ++l) rows.row(l - 1) = residual.row(i).segment(lags - l, N);
    const Vector now = residual.row(i).segment(lags, N);
    // Normal equations with the columns at unit length: that a share is right to a few digits is all that is asked.
    const Vector length = rows.rowwise().norm().cwiseMax(1e-300);
    const Matrix unit = length.cwiseInverse().asDiagonal() * rows;
    Matrix gram = unit * unit.transpose();
    gram.diagonal().array() += 1e-10;
    const Vector moments = unit * now;
    const Vector weights = solve(gram, moments);
    const double total = (now.array() - now.mean()).square().sum();
    const double left = (now - unit.transpose() * weights).squaredNorm();
    const double freedom = static_cast<double>(N - 1) / static_cast<double>(N - regressors);
    if (total > 0) share(i) = std::max(0.0, 1 - freedom * left / total);
  }
  return share;
}

}  // namespace wheelhop
