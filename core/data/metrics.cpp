#include "core/data/metrics.hpp"

#include <cmath>
#include <limits>
#include <stdexcept>

namespace wheelhop {
namespace {

void check_shapes(ConstMatrixRef y, ConstMatrixRef yhat, Index skip) {
  if (y.rows() != yhat.rows() || y.cols() != yhat.cols())
    throw std::invalid_argument("metrics: the measured and the simulated output differ in shape");
  if (skip < 0 || skip >= y.cols()) throw std::invalid_argument("metrics: skip must lie in [0, number of samples)");
}

/// Scaling by the largest entry keeps the squares of very large and very small signals inside the range of a double.
double root_mean_square(ConstMatrixRef row) {
  const double scale = row.cwiseAbs().maxCoeff<Eigen::PropagateNaN>();
  if (!(scale > 0)) return scale;
  if (scale == std::numeric_limits<double>::infinity()) return scale;
  return scale * std::sqrt((row / scale).squaredNorm() / static_cast<double>(row.size()));
}

}  // namespace

Vector rms(ConstMatrixRef y, Index skip) {
  check_shapes(y, y, skip);
  Vector result(y.rows());
  for (Index i = 0; i < y.rows(); ++i) result(i) = root_mean_square(y.row(i).rightCols(y.cols() - skip));
  return result;
}

Vector rmse(ConstMatrixRef y, ConstMatrixRef yhat, Index skip) {
  check_shapes(y, yhat, skip);
  return rms(y - yhat, skip);
}

Vector nrmse(ConstMatrixRef y, ConstMatrixRef yhat, Index skip) {
  const Vector error = rmse(y, yhat, skip);
  const Vector size = rms(y, skip);
  Vector result(error.size());
  for (Index i = 0; i < error.size(); ++i) result(i) = error(i) == 0 ? 0 : error(i) / size(i);
  return result;
}

Vector vaf_percent(ConstMatrixRef y, ConstMatrixRef yhat, Index skip) {
  const Vector ratio = nrmse(y, yhat, skip);
  Vector result(ratio.size());
  for (Index i = 0; i < ratio.size(); ++i) {
    const bool finite = y.row(i).tail(y.cols() - skip).allFinite() && yhat.row(i).tail(y.cols() - skip).allFinite();
    result(i) = finite ? 100 * (1 - ratio(i) * ratio(i)) : std::numeric_limits<double>::quiet_NaN();
  }
  return result;
}

}  // namespace wheelhop
