#include "core/identify/pole_search.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/identify/judgements.hpp"
#include "core/identify/realisation.hpp"
#include "core/kernels/hankel.hpp"

namespace wheelhop {
namespace {

/// Judgement: a block that a mode turns through by one radian has its response to within 1e-3 by so many moments.
constexpr Index kMoments = 3;
/// Legendre polynomials P_0 .. P_(count-1) at the samples of a block, orthonormalised on them (count x stride).
Matrix legendre_rows(Index stride, Index count) {
  Matrix rows(count, stride);
  for (Index r = 0; r < count; ++r) {
    for (Index i = 0; i < stride; ++i) {
      const double at = stride == 1 ? 0 : 2.0 * static_cast<double>(i) / static_cast<double>(stride - 1) - 1;
      rows(r, i) = std::pow(at, static_cast<double>(r));
    }
    for (Index other = 0; other < r; ++other) rows.row(r) -= rows.row(r).dot(rows.row(other)) * rows.row(other);
    rows.row(r).normalize();
  }
  return rows;
}

/// A^(1/q) and the C whose mean over a block is `mean_C`. None where the eigenvectors of A do not tell its modes apart.
std::optional<PoleSet> at_record_rate(ConstMatrixRef A, ConstMatrixRef mean_C, Index stride) {
  if (stride == 1) return PoleSet{A, mean_C, 1};
  const Spectrum spectrum = eigen_decomposition(A);
  const Index n = A.rows();
  ComplexVector root(n), mean(n);
  for (Index i = 0; i < n; ++i) {
    // No motion of a real mode alternates from block to block; a negative eigenvalue stands for a fast decay.
    const std::complex<double> value =
        spectrum.values(i).imag() == 0 ? std::abs(spectrum.values(i)) : spectrum.values(i);
    root(i) = std::pow(std::max(std::abs(value), 1e-12), 1.0 / static_cast<double>(stride)) *
              std::polar(1.0, std::arg(value) / static_cast<double>(stride));
    std::complex<double> power = 1, sum = 0;
    for (Index k = 0; k < stride; ++k, power *= root(i)) sum += power;
    mean(i) = sum / static_cast<double>(stride);
  }
  const ComplexMatrix inverse = solve_complex(spectrum.vectors, ComplexMatrix::Identity(n, n));
  const ComplexMatrix full_A = spectrum.vectors * root.asDiagonal() * inverse;
  const ComplexMatrix full_C = mean_C * (spectrum.vectors * mean.cwiseInverse().asDiagonal() * inverse);
  PoleSet set{full_A.real(), full_C.real(), stride};
  if (!all_finite(set.A) || !all_finite(set.C)) return {};
  return set;
}

/// Rows of the block-Hankel matrices at one block length.
struct Layout {
  Index s, gap, inputs, outputs;
  Index rows() const { return 1 + inputs * (2 * s + gap) + outputs * s; }
  Index columns(Index samples) const { return samples - 2 * s - gap + 1; }
  bool fits(Index samples) const {
    return static_cast<double>(columns(samples)) >= kJudged.columns_per_row * static_cast<double>(rows());
  }
};

}  // namespace

BlockAverages block_averages(ConstMatrixRef u, ConstMatrixRef y, Index stride, Index moments) {
  const Index m = u.rows(), count = u.cols() / stride, r = std::min(moments, stride);
  BlockAverages result{stride, Matrix(m * r, count), Matrix(y.rows(), count)};
  const Matrix weights = legendre_rows(stride, r).transpose();
  for (Index j = 0; j < count; ++j) {
    const Matrix products = u.middleCols(j * stride, stride) * weights;
    result.u.col(j) = products.reshaped();
    result.y.col(j) = y.middleCols(j * stride, stride).rowwise().mean();
  }
  return result;
}

std::vector<std::vector<PoleSet>> pole_sets(ConstMatrixRef u, ConstMatrixRef y, const PoleSearchOptions& options) {
  std::vector<std::vector<PoleSet>> sets(static_cast<std::size_t>(options.highest_order - options.lowest_order + 1));
  const Index p = y.rows();
  for (Index stride = 1; stride <= u.cols() / 8; stride *= 2) {
    const BlockAverages data = block_averages(u, y, stride, kMoments);
    // A delay of less than a block still reaches from one block into the next.
    const Index gap = (options.gap + stride - 1) / stride;
    Layout layout{options.block_rows, gap, data.u.rows(), p};
    while (layout.s > 2 && !layout.fits(data.u.cols())) --layout.s;
    if (!layout.fits(data.u.cols())) break;
    const Index s = layout.s;
    const HankelFactor factor = hankel_factor({{data.u, s, s + gap}, {data.u, 0, s}, {data.y, s + gap, s}});
    const Index known = 1 + data.u.rows() * (s + gap), instruments = data.u.rows() * s;
    const Matrix R32 = factor.R.block(known + instruments, known, p * s, instruments);
    const Vector values = singular_values(R32);
    const Index most = std::min({options.highest_order, p * (s - 1), values.size() - 1});
    if (most < 1 || !(values(0) > 0)) continue;
    const Matrix U = leading_left_vectors(R32, most);
    for (Index n = options.lowest_order; n <= most && values(n - 1) > 1e-10 * values(0); ++n) {
      const ObservabilityPair pair = shift_invariance(U.leftCols(n) * values.head(n).cwiseSqrt().asDiagonal(), p);
      if (!all_finite(pair.A) || !all_finite(pair.C)) continue;
      if (std::optional<PoleSet> set = at_record_rate(pair.A, pair.C, stride))
        sets[static_cast<std::size_t>(n - options.lowest_order)].push_back(std::move(*set));
    }
  }
  return sets;
}

}  // namespace wheelhop
