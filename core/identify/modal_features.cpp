#include "core/identify/modal_features.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/kernels/correlation.hpp"
#include "core/kernels/streamed_qr.hpp"

namespace wheelhop {
namespace {

constexpr Index kChunk = 1024;  // samples; a dozen rows of them fit into the second cache, and no result depends on it
constexpr double kSeparable = 1e-8;  // see separate_modes
// Moments lose eps times their condition. A judgement: above this loss reflections take over, which is far below what
// noise makes of B and D in any record.
constexpr double kMomentsError = 1e-10;

}  // namespace

std::optional<Modes> separate_modes(ConstMatrixRef A) {
  const Index n = A.rows();
  if (!all_finite(A)) return std::nullopt;
  const Spectrum spectrum = eigen_decomposition(A);
  Modes modes;
  modes.T.resize(n, n);
  for (Index i = 0; i < n; ++i) {
    const std::complex<double> value = spectrum.values(i);
    const bool is_pair = value.imag() != 0;
    if (is_pair && i + 1 == n) return std::nullopt;
    modes.blocks.push_back({i, value.real(), value.imag(), is_pair});
    const ComplexVector v = spectrum.vectors.col(i) / spectrum.vectors.col(i).norm();
    modes.T.col(i) = v.real();
    if (is_pair) modes.T.col(++i) = v.imag();
  }
  if (n == 0) return modes;
  const Vector sizes = singular_values(modes.T);
  if (!(sizes(n - 1) > kSeparable * sizes(0))) return std::nullopt;
  return modes;
}

ModalFeatures::ModalFeatures(const Modes& modes, ConstMatrixRef u, ConstMatrixRef y, Index direct_inputs)
    : modes_(modes),
      u_(u),
      y_(y),
      at_start_(modes.T.rows() * u.rows()),
      at_direct_(at_start_ + modes.T.rows()),
      at_one_(at_direct_ + direct_inputs),
      at_y_(at_one_ + 1),
      rows_(at_y_ + y.rows()),
      chunk_(rows_, kChunk + kCorrelationPadding) {
  restart();
}

void ModalFeatures::restart() {
  chunk_.setZero();
  state_ = Vector::Zero(at_direct_);
  for (const Modes::Block& block : modes_.blocks) state_(at_start_ + block.first) = 1;
  first_ = filled_ = 0;
}

bool ModalFeatures::next() {
  first_ += filled_;
  filled_ = std::min(kChunk, u_.cols() - first_);
  if (filled_ <= 0) return false;
  if (filled_ < kChunk) chunk_.rightCols(kChunk + kCorrelationPadding - filled_).setZero();
  for (Index j = 0; j <= u_.rows(); ++j) {  // the last time around without an input: powers of the eigenvalues
    const bool is_power = j == u_.rows();
    // The input stands in the row of its direct term, or in that of the 1 until this is filled.
    double* const input = chunk_.row(at_one_).data();
    if (is_power)
      std::fill_n(input, filled_, 0.0);
    else
      for (Index k = 0; k < filled_; ++k) input[k] = u_(j, first_ + k);
    for (const Modes::Block& block : modes_.blocks) {
      const Index row = j * modes_.T.rows() + block.first;
      double* const re = chunk_.row(row).data();
      double x = state_(row), z = block.is_pair ? state_(row + 1) : 0;
      if (block.is_pair) {
        double* const im = chunk_.row(row + 1).data();
        for (Index k = 0; k < filled_; ++k) {
          re[k] = x;
          im[k] = z;
          const double old = x;
          x = (block.b * z + input[k]) + block.a * x;
          z = block.a * z - block.b * old;
        }
        state_(row + 1) = z;
      } else {
        for (Index k = 0; k < filled_; ++k) {
          re[k] = x;
          x = block.a * x + input[k];
        }
      }
      state_(row) = x;
    }
  }
  drop_faded(state_.tail(modes_.T.rows()));
  for (Index j = at_direct_; j < at_one_; ++j)
    for (Index k = 0; k < filled_; ++k) chunk_(j, k) = u_(j - at_direct_, first_ + k);
  chunk_.row(at_one_).head(filled_).setOnes();
  for (Index i = 0; i < y_.rows(); ++i)
    for (Index k = 0; k < filled_; ++k) chunk_(at_y_ + i, k) = y_(i, first_ + k);
  return true;
}

std::optional<Matrix> ModalFeatures::factor_of_moments() {
  Matrix moments = Matrix::Zero(rows_, rows_);
  const Index n = modes_.T.rows();
  std::vector<const double*> fixed;
  std::vector<Index> row_of;
  Vector sums(rows_);
  for (bool faded = false; next();) {
    fixed.clear();
    row_of.clear();
    for (Index i = 0; i < rows_; ++i) {
      const bool is_power = i >= at_start_ && i < at_direct_;
      if (is_power && faded) continue;
      fixed.push_back(chunk_.row(i).data());
      row_of.push_back(i);
      sums.setZero();
      const auto count = static_cast<Index>(fixed.size());
      add_correlations(fixed.data(), count, fixed.back(), 1, filled_, sums.data());
      for (Index f = 0; f < count; ++f) moments(row_of[static_cast<std::size_t>(f)], i) += sums(f);
    }
    faded = state_.segment(at_start_, n).isZero(0);
  }
  if (!all_finite(moments)) return std::nullopt;
  const Index count = at_y_;
  const Vector size = moments.diagonal().cwiseSqrt();
  if (!(size.head(count).minCoeff() > 0)) return std::nullopt;
  Matrix scaled = moments.topLeftCorner(count, count).selfadjointView<Eigen::Upper>();
  scaled = size.head(count).cwiseInverse().asDiagonal() * scaled * size.head(count).cwiseInverse().asDiagonal();
  const Vector values = symmetric_eigen(scaled).values;
  if (!(values(0) * kMomentsError > values(count - 1) * std::numeric_limits<double>::epsilon())) return std::nullopt;
  Matrix R = Matrix::Zero(rows_, rows_);
  const Matrix upper = Eigen::LLT<Matrix, Eigen::Lower>(scaled).matrixU();
  R.topLeftCorner(count, count) = upper * size.head(count).asDiagonal();
  R.topRightCorner(count, rows_ - count) = upper.transpose().triangularView<Eigen::Lower>().solve(
      Matrix(size.head(count).cwiseInverse().asDiagonal() * moments.topRightCorner(count, rows_ - count)));
  return R;
}

Matrix ModalFeatures::factor() {
  restart();
  if (std::optional<Matrix> R = factor_of_moments()) return *R;
  restart();
  StreamedQr stream(rows_, 512);
  while (next())
    for (Index done = 0; done < filled_;) {
      const Index count = std::min(stream.capacity(), filled_ - done);
      stream.next(count) = chunk_.middleCols(done, count).transpose();
      done += count;
    }
  return stream.finish();
}

}  // namespace wheelhop
