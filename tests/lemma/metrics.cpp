#include "core/data/metrics.hpp"

#include <catch2/catch.hpp>
#include <limits>
#include <stdexcept>

#include "core/base/random.hpp"

using namespace wheelhop;

namespace {
const double kInf = std::numeric_limits<double>::infinity();
Matrix record() { return (Random(1, Stream::noise).normal(3, 500).array() + 2).matrix(); }
}  // namespace

TEST_CASE("a perfect model scores 100 percent and a zero model scores 0, mean or not") {
  const Matrix y = record();
  CHECK(vaf_percent(y, y) == Vector::Constant(3, 100));
  const Vector zero = vaf_percent(y, Matrix::Zero(3, 500));
  CHECK(zero.cwiseAbs().maxCoeff() < 1e-12);
  CHECK(nrmse(y, Matrix::Zero(3, 500)).isApproxToConstant(1, 1e-14));
}

TEST_CASE("VAF does not remove means: the mean of a biased signal alone scores as its share of the power") {
  const Matrix y = (Matrix(1, 2) << 3, 5).finished();
  const Matrix mean = Matrix::Constant(1, 2, 4);
  CHECK(vaf_percent(y, mean)(0) == Approx(100 * (1 - 2.0 / 34)));
}

TEST_CASE("VAF follows its definition for scaled, sign-flipped and unrelated models, unclipped") {
  const Matrix y = record();
  CHECK(vaf_percent(y, 0.5 * y).isApproxToConstant(75, 1e-12));
  CHECK(vaf_percent(y, -y).isApproxToConstant(-300, 1e-12));
  CHECK(vaf_percent(y, 2 * y).cwiseAbs().maxCoeff() < 1e-10);
  CHECK(vaf_percent(y, 3 * y).isApproxToConstant(-300, 1e-12));
}

TEST_CASE("VAF is unchanged when measurement and model are scaled together, even to the edge of the range") {
  const Matrix y = record(), yhat = y + 0.1 * Random(2, Stream::noise).normal(3, 500);
  const Vector reference = vaf_percent(y, yhat);
  for (double scale : {-1.0, 1e-170, 1e170}) CHECK(vaf_percent(scale * y, scale * yhat).isApprox(reference, 1e-12));
}

TEST_CASE("VAF = 100 (1 - NRMSE^2) and NRMSE = RMSE / RMS, row by row") {
  const Matrix y = record(), yhat = record() + Random(2, Stream::noise).normal(3, 500);
  const Vector relative = nrmse(y, yhat);
  CHECK(vaf_percent(y, yhat).isApprox((100 * (1 - relative.array().square())).matrix(), 1e-12));
  CHECK(rmse(y, yhat).isApprox(relative.cwiseProduct(rms(y)), 1e-12));
  CHECK(rmse(y, yhat)(1) == Approx(std::sqrt((y.row(1) - yhat.row(1)).squaredNorm() / 500)));
  CHECK(rms((Matrix(1, 2) << 3, 4).finished())(0) == Approx(std::sqrt(12.5)));
}

TEST_CASE("skipped samples have no say, the first one kept has") {
  Matrix y = record(), yhat = y;
  yhat.leftCols(10).setConstant(1e6);
  CHECK(vaf_percent(y, yhat, 10) == Vector::Constant(3, 100));
  CHECK(vaf_percent(y, yhat, 9).maxCoeff() < 0);
  y(0, 3) = kInf;
  CHECK(vaf_percent(y, y, 4)(0) == 100);
}

TEST_CASE("dead channels and broken numbers give infinities and NaN, never a plausible score") {
  const Matrix zero = Matrix::Zero(1, 4), one = Matrix::Ones(1, 4);
  CHECK(vaf_percent(zero, one)(0) == -kInf);
  CHECK(vaf_percent(zero, zero)(0) == 100);
  for (double broken : {kInf, -kInf, std::numeric_limits<double>::quiet_NaN()}) {
    Matrix bad = one;
    bad(2) = broken;
    CHECK(std::isnan(vaf_percent(one, bad)(0)));
    CHECK(std::isnan(vaf_percent(bad, one)(0)));
    CHECK(std::isnan(vaf_percent(bad, bad)(0)));
  }
}

TEST_CASE("shapes that differ and a skip that leaves nothing are refused") {
  const Matrix y = record();
  CHECK_THROWS_AS(vaf_percent(y, y.topRows(2)), std::invalid_argument);
  CHECK_THROWS_AS(vaf_percent(y, y.leftCols(499)), std::invalid_argument);
  CHECK_THROWS_AS(rmse(y, y, 500), std::invalid_argument);
  CHECK_THROWS_AS(rms(y, -1), std::invalid_argument);
  CHECK_THROWS_AS(nrmse(Matrix(3, 0), Matrix(3, 0)), std::invalid_argument);
}
