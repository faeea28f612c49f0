#include "core/identify/excitation.hpp"

#include <algorithm>
#include <cmath>

#include "core/identify/judgements.hpp"

namespace wheelhop {
namespace {

/// Principal values below this share of the first are round-off of the covariance.
constexpr double kRoundOff = 1e-13;
/// See collinear_input().
constexpr double kCollinear = 1e-10;
constexpr Index kCollinearReach = 4;

Matrix lagged(ConstMatrixRef u, Index lags, Index spacing) {
  const Index m = u.rows(), columns = u.cols() - (lags - 1) * spacing;
  Matrix rows(m * lags, columns);
  for (Index l = 0; l < lags; ++l) rows.middleRows(l * m, m) = u.middleCols(l * spacing, columns);
  return rows.colwise() - Vector(rows.rowwise().mean());
}

Index followed_at(ConstMatrixRef u, ConstMatrixRef y, Index limit, Index spacing) {
  const Matrix H = lagged(u, kJudged.lags, spacing);
  const Index N = H.cols(), p = y.rows(), d = H.rows();
  const Matrix late = y.rightCols(N).colwise() - Vector(y.rightCols(N).rowwise().mean());
  const SymmetricEigen components = symmetric_eigen(H * H.transpose());
  const Matrix products = components.vectors.transpose() * (H * late.transpose());
  const double largest = components.values(d - 1);
  Vector left = late.rowwise().squaredNorm();
  Matrix taken = Matrix::Zero(d, p);  // largest component first
  Index used = 0;
  for (Index j = 0; j < d && components.values(d - 1 - j) > kRoundOff * largest; ++j, ++used)
    taken.row(j) = products.row(d - 1 - j).array().square() / components.values(d - 1 - j);
  left -= taken.colwise().sum().transpose();
  const Vector variance =
      (left / static_cast<double>(N - used)).cwiseMax(1e-20 * late.rowwise().squaredNorm() / static_cast<double>(N));
  for (Index i = 0; i < p; ++i) taken.col(i) /= std::max(variance(i), 1e-300);
  const Vector by_component = taken.rowwise().sum();
  for (Index r = 0; r < std::min(used, limit); ++r) {
    const double freedom = static_cast<double>((used - r) * p);
    if (!(by_component.segment(r, used - r).sum() > freedom + kJudged.chance * std::sqrt(2 * freedom))) return r;
  }
  return std::min(used, limit);
}

}  // namespace

Index followed_directions(ConstMatrixRef u, ConstMatrixRef y, Index limit) {
  Index most = 0;
  for (Index spacing = 1; spacing <= kJudged.widest_spacing && most < limit; spacing *= 4)
    if (u.cols() - (kJudged.lags - 1) * spacing > 3 * kJudged.lags * u.rows())
      most = std::max(most, followed_at(u, y, limit, spacing));
  return most;
}

Index collinear_input(ConstMatrixRef u) {
  const Index m = u.rows(), width = 2 * kCollinearReach + 1;
  if (m < 2 || u.cols() < 4 * width * m) return -1;
  const Matrix H = lagged(u, width, 1);
  for (Index i = m - 1; i >= 0; --i) {
    Matrix others((m - 1) * width, H.cols());
    for (Index l = 0, row = 0; l < width; ++l)
      for (Index j = 0; j < m; ++j)
        if (j != i) others.row(row++) = H.row(l * m + j);
    const Matrix own = H.row(kCollinearReach * m + i);
    const double left = least_squares(others.transpose(), own.transpose()).residual_norm;
    if (left * left <= kCollinear * own.squaredNorm()) return i;
  }
  return -1;
}

}  // namespace wheelhop
