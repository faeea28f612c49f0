// The triangular factor of block-Hankel matrices: three ways to one factor, however the record arrives.
#include "core/kernels/hankel.hpp"

#include <catch2/catch.hpp>

#include "core/base/random.hpp"
#include "core/kernels/cholesky.hpp"
#include "core/kernels/correlation.hpp"
#include "core/kernels/hankel_gram.hpp"
#include "core/kernels/kernel_sets.hpp"
#include "core/kernels/streamed_qr.hpp"
#include "core/model/linear.hpp"
#include "tests/support/systems.hpp"

using namespace wheelhop;
using namespace wheelhop::test;

namespace {

/// White through `poles` equal first-order low-passes: the more, the worse the condition of its block-Hankel matrix.
Matrix drive(Index channels, Index samples, int poles, Random& random) {
  Matrix u = random.normal(channels, samples);
  for (int p = 0; p < poles; ++p)
    for (Index k = 1; k < samples; ++k) u.col(k) = 0.8 * u.col(k - 1) + 0.2 * u.col(k);
  return u;
}

Matrix response(ConstMatrixRef u, Index outputs, double noise, Random& random) {
  LinearModel model;
  model.A = Matrix::Zero(4, 4);
  model.A.topLeftCorner(2, 2) << 0.95, 0.2, -0.2, 0.95;
  model.A.bottomRightCorner(2, 2) << 0.5, 0.6, -0.6, 0.5;
  model.B = random.normal(4, u.rows());
  model.C = random.normal(outputs, 4);
  model.D = random.normal(outputs, u.rows());
  model.y0 = 5 * random.normal(outputs, 1);
  const Matrix y = simulate(model, u, Vector::Zero(4)).y;
  return y + noise * random.normal(outputs, u.cols());
}

/// Relative error of R R' against the Gram matrix of the rows in long double.
double product_error(ConstMatrixRef R, const std::vector<HankelBlock>& blocks, Index columns) {
  using Long = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;
  Long gram = Long::Zero(R.rows(), R.rows());
  Long column(R.rows(), 1);
  for (Index k = 0; k < columns; ++k) {
    column(0) = 1;
    Index at = 1;
    for (const HankelBlock& block : blocks)
      for (Index l = 0; l < block.rows; ++l)
        for (Index c = 0; c < block.signal.rows(); ++c) column(at++) = block.signal(c, k + block.first + l);
    gram += column * column.transpose();
  }
  const Long factor = R.cast<long double>();
  return static_cast<double>((factor * factor.transpose() - gram).norm() / gram.norm());
}

}  // namespace

TEST_CASE("three ways give one factor, on white and band-limited drives, with offsets and small channels") {
  Random random = numbers(4101);
  for (const int poles : {0, 1, 3})
    for (const Index inputs : {1, 2})
      for (const double offset : {0.0, 30.0}) {
        const Index samples = 900, s = 8;
        Matrix u = drive(inputs, samples, poles, random);
        Matrix y = response(u, 3, 0.05, random);
        u.array() += offset;
        y.row(1) *= 1e-6;
        const std::vector<HankelBlock> blocks = {{u, s, s}, {u, 0, s}, {y, 0, s}, {y, s, s}};
        const Matrix R = hankel_factor_by(FactorMethod::orthogonal, blocks)->R;
        const Vector size = R.rowwise().norm();
        for (const FactorMethod method : {FactorMethod::gram, FactorMethod::extended_gram}) {
          const auto factor = hankel_factor_by(method, blocks);
          CAPTURE(poles, inputs, offset, to_string(method));
          REQUIRE(factor);
          CHECK(product_error(factor->R, blocks, samples - 2 * s + 1) < 1e-14);
          // Row by row: what it adds to those above is as well known as the factor says.
          for (Index i = 0; i < R.rows(); ++i) {
            const double diagonal = std::abs(factor->R(i, i) / R(i, i) - 1);
            CHECK(diagonal < 30 * factor->error + 1e-7);
            CHECK((factor->R.row(i) - R.row(i)).norm() < (30 * factor->error + 1e-7) * size(i));
          }
        }
        const HankelFactor chosen = hankel_factor(blocks);
        CHECK(chosen.error <= kFactorError);
        CHECK(chosen.method != FactorMethod::orthogonal);
      }
}

TEST_CASE(
    "twice the precision keeps a factor that the plain Gram matrix loses, and a lost row is left to reflections") {
  Random random = numbers(4102);
  const Index samples = 3000, s = 10;
  const Matrix u = drive(1, samples, 4, random), y = response(u, 2, 0, random);  // no noise
  const std::vector<HankelBlock> blocks = {{u, s, s}, {u, 0, s}, {y, s, s}};
  const auto plain = hankel_factor_by(FactorMethod::gram, blocks);
  CHECK((!plain || plain->error > kFactorError));
  const HankelFactor chosen = hankel_factor(blocks);
  const Matrix R = hankel_factor_by(FactorMethod::orthogonal, blocks)->R;
  // The inputs' part, which is ill-conditioned but not singular.
  const Index inputs = 1 + 2 * s;
  const auto extended = hankel_factor_by(FactorMethod::extended_gram, {{u, s, s}, {u, 0, s}});
  REQUIRE(extended);
  const Matrix block = R.topLeftCorner(inputs, inputs);
  CHECK(block.diagonal().maxCoeff() / block.diagonal().minCoeff() > 1e3);
  for (Index i = 0; i < inputs; ++i) CHECK(extended->R(i, i) == Approx(block(i, i)).epsilon(1e-9));
  CHECK((chosen.R * chosen.R.transpose() - R * R.transpose()).norm() < 1e-13 * (R * R.transpose()).norm());

  Matrix square(1, samples);  // without rounding, which would be a signal of its own
  for (Index k = 0; k < samples; ++k) square(k) = k % 2 == 0 ? 1 : -1;
  const HankelFactor singular = hankel_factor({{square, 0, s}});
  CHECK(singular.method == FactorMethod::orthogonal);
  CHECK_FALSE(hankel_factor_by(FactorMethod::gram, {{Matrix::Zero(1, 100), 0, 3}}));
}

TEST_CASE("chunks of any size make the factor of the whole record, records side by side that of all their columns") {
  Random random = numbers(4103);
  const Index s = 5;
  for (const Precision precision : {Precision::plain, Precision::extended}) {
    std::vector<Matrix> inputs, outputs;
    StreamedQr rows(1 + 2 * s + 2 * s);
    HankelGram gram({1, 2}, {{0, 0, 2 * s}, {1, s, s}}, precision);
    Index columns = 0;
    for (const Index samples : {2500, 7, 60, 1200}) {  // the second is shorter than a column
      inputs.push_back((random.normal(1, samples).array() + 3).matrix());
      outputs.push_back(random.normal(2, samples));
      for (Index k = 0; k + 2 * s <= samples; ++k, ++columns) {
        MatrixRef row = rows.next(1);
        row << 1, inputs.back().middleCols(k, 2 * s).reshaped().transpose(),
            outputs.back().middleCols(k + s, s).reshaped().transpose();
      }
      for (Index first = 0; first < samples;) {
        const Index count = std::min<Index>(1 + random.integer(1500), samples - first);
        gram.feed({inputs.back().middleCols(first, count), outputs.back().middleCols(first, count)});
        first += count;
      }
      gram.end_record();
    }
    CHECK(gram.columns() == columns);
    const auto factor = gram.factor();
    REQUIRE(factor);
    const Matrix expected = rows.finish().transpose();
    CHECK((factor->R - expected).norm() < 1e-11 * expected.norm());
  }
}

TEST_CASE("correlations: every number of sequences and lags, any length, and twice the precision is exact") {
  Random random = numbers(4104);
  for (const Index count : {1, 7, 8, 40, 333})
    for (Index fixed_count = 1; fixed_count <= 7; ++fixed_count)
      for (const Index lags : {1, 2, 5, 13}) {
        Matrix fixed = Matrix::Zero(count + 8, fixed_count);
        fixed.topRows(count) = random.normal(count, fixed_count);
        const Vector moving = random.normal(count + lags - 1 + kCorrelationPadding, 1);
        std::vector<const double*> pointers;
        for (Index f = 0; f < fixed_count; ++f) pointers.push_back(fixed.col(f).data());
        std::vector<double> plain(static_cast<std::size_t>(fixed_count * lags), 1), high(plain), low(plain.size(), 0);
        add_correlations(pointers.data(), fixed_count, moving.data(), lags, count, plain.data());
        add_correlations_extended(pointers.data(), fixed_count, moving.data(), lags, count, high.data(), low.data());
        for (Index f = 0; f < fixed_count; ++f)
          for (Index l = 0; l < lags; ++l) {
            const double expected = 1 + fixed.col(f).head(count).dot(moving.segment(l, count));
            const auto at = static_cast<std::size_t>(f * lags + l);
            CHECK(plain[at] == Approx(expected).margin(1e-12));
            CHECK(high[at] == Approx(expected).margin(1e-12));
          }
      }
  // 1 + tiny - 1 over many products, of which a double keeps nothing.
  const Index count = 4000;
  std::vector<double> fixed(static_cast<std::size_t>(count), 1.0), moving(fixed.size() + kCorrelationPadding, 0x1p-80);
  moving[0] = 1;
  moving[static_cast<std::size_t>(count) - 1] = -1;
  const double* const pointer = fixed.data();
  double high = 0, low = 0;
  add_correlations_extended(&pointer, 1, moving.data(), 1, count, &high, &low);
  CHECK(high + low == Approx((count - 2) * 0x1p-80).epsilon(1e-9));
}

namespace {

/// The sets that this processor has.
std::vector<KernelSet> kernel_sets() {
  std::vector<KernelSet> sets = {KernelSet::portable};
  if (kernel_set() >= KernelSet::avx2) sets.push_back(KernelSet::avx2);
  if (kernel_set() >= KernelSet::avx512) sets.push_back(KernelSet::avx512);
  return sets;
}

template <class Function>
Function* of(KernelSet set, Function* portable, [[maybe_unused]] Function* avx2, [[maybe_unused]] Function* avx512) {
#ifdef __x86_64__
  if (set == KernelSet::avx512) return avx512;
  if (set == KernelSet::avx2) return avx2;
#endif
  return portable;
}

/// Symmetric and positive definite, with condition 10^(2 decades); room for whole groups of rows.
Matrix positive(Index n, double decades, Random& random) {
  const Matrix Q = random.normal(n, n) *
                   Vector::LinSpaced(n, 0, -decades).unaryExpr([](double x) { return std::pow(10.0, x); }).asDiagonal();
  Matrix A = Matrix::Zero(cholesky_stride(n), n);
  A.topRows(n) = Matrix(Q * Q.transpose()).selfadjointView<Eigen::Lower>();
  return A;
}

}  // namespace

TEST_CASE("correlations: every instruction set gives the same bits") {
  Random random = numbers(4105);
  const Index count = 168, lags = 19, fixed_count = 7;
  const Matrix fixed = random.normal(count, fixed_count);
  const Vector moving = random.normal(count + lags - 1 + kCorrelationPadding, 1);
  std::vector<const double*> pointers;
  for (Index f = 0; f < fixed_count; ++f) pointers.push_back(fixed.col(f).data());
  std::vector<double> first, first_high, first_low;
  for (const KernelSet set : kernel_sets()) {
    std::vector<double> plain(static_cast<std::size_t>(fixed_count * lags), 1), high(plain), low(plain.size(), 0);
    of(set, plain_portable, plain_avx2, plain_avx512)(pointers.data(), fixed_count, moving.data(), lags, count,
                                                      plain.data());
    of(set, extended_portable, extended_avx2, extended_avx512)(pointers.data(), fixed_count, moving.data(), lags, count,
                                                               high.data(), low.data());
    if (first.empty()) first = plain, first_high = high, first_low = low;
    CHECK(plain == first);
    CHECK(high == first_high);
    CHECK(low == first_low);
  }
}

TEST_CASE(
    "Cholesky's factor: its square is the matrix, on every instruction set the same bits, and no root of a loss") {
  Random random = numbers(4106);
  for (const Index n : {1, 2, 3, 7, 8, 9, 15, 16, 17, 31, 40, 67}) {
    const Matrix A = positive(n, 2, random);
    Matrix first, first_high, first_low;
    for (const KernelSet set : kernel_sets()) {
      Matrix L = A, high = A, low = Matrix::Zero(A.rows(), n);
      REQUIRE(of(set, plain_cholesky_portable, plain_cholesky_avx2, plain_cholesky_avx512)(L.data(), n, L.rows()));
      REQUIRE(of(set, extended_cholesky_portable, extended_cholesky_avx2, extended_cholesky_avx512)(
          high.data(), low.data(), n, high.rows(), 0));
      for (Matrix* one : {&L, &high, &low}) *one = Matrix(one->topRows(n).triangularView<Eigen::Lower>());
      CHECK((L * L.transpose() - A.topRows(n)).norm() < 1e-15 * static_cast<double>(n + 4) * A.norm());
      using Long = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;
      const Long whole = high.cast<long double>() + low.cast<long double>();
      CHECK(static_cast<double>((whole * whole.transpose() - A.topRows(n).cast<long double>()).norm()) <
            1e-18 * static_cast<double>(n + 4) * A.norm());
      if (first.size() == 0) first = L, first_high = high, first_low = low;
      CHECK(L == first);
      CHECK(high == first_high);
      CHECK(low == first_low);
    }
    Matrix lost = A, lost_high = A, lost_low = Matrix::Zero(A.rows(), n);
    lost(n - 1, n - 1) = lost_high(n - 1, n - 1) = -1;
    CHECK_FALSE(cholesky_plain(lost));
    CHECK_FALSE(cholesky_extended(lost_high, lost_low, 0));
  }
}
