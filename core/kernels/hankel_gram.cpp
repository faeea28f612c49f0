// Compiled with -ffp-contract=off, as double_double.hpp asks for.
#include "core/kernels/hankel_gram.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "core/kernels/cholesky.hpp"
#include "core/kernels/correlation.hpp"
#include "core/kernels/double_double.hpp"

namespace wheelhop {
namespace {

constexpr Index kChunk = 1024;         // columns summed at once: all channels stay in the first two levels of cache
constexpr Index kShiftSamples = 4096;  // of which the mean is taken from a channel
constexpr double kEps = 0x1p-53;

/// Rounding errors of a sum relative to the root of the product of the two diagonal sums: eight partial sums of at most
/// 128 products each, their total over the chunks, and the recurrence over the lags, which walk at random.
constexpr double kPlainSum = 16 * kEps;
constexpr double kExtendedSum = 16 * kEps * kEps;

/// Largest relative error of a diagonal entry of the factor R of a scaled Gram matrix whose entries are off by `sums`:
/// dR = R Phi(E), E = R^-1 dG R^-T, Phi the lower triangle with half the diagonal, so dR_ii / R_ii = E_ii / 2. Entries
/// of dG are drawn as products z_i z_j of random signs, four times.
double diagonal_error(ConstMatrixRef R, double sums) {
  const Index n = R.rows();
  constexpr int kDraws = 4;
  std::uint32_t state = 1;
  Matrix draws(n, kDraws);
  for (double& sign : draws.reshaped()) {
    state = state * 1664525u + 1013904223u;  // Numerical Recipes' generator; its top bit is a sign
    sign = (state >> 31) != 0 ? 1 : -1;
  }
  R.triangularView<Eigen::Lower>().solveInPlace(draws);
  return 0.5 * sums * draws.rowwise().squaredNorm().maxCoeff() / kDraws;
}

}  // namespace

void HankelGram::Sums::reset(Index count, Precision precision) {
  high.assign(static_cast<std::size_t>(count), 0.0);
  low.assign(precision == Precision::extended ? static_cast<std::size_t>(count) : 0, 0.0);
}

HankelGram::HankelGram(std::vector<Index> channels, std::vector<HankelRows> rows, Precision precision)
    : precision_(precision), rows_(std::move(rows)) {
  for (std::size_t s = 0; s < channels.size(); ++s) {
    Signal one{channels[s], channels_, std::numeric_limits<Index>::max(), 0};
    channels_ += channels[s];
    signal_of_.insert(signal_of_.end(), static_cast<std::size_t>(channels[s]), static_cast<Index>(s));
    for (const HankelRows& item : rows_)
      if (item.signal == static_cast<Index>(s)) {
        one.from = std::min(one.from, item.first);
        one.to = std::max(one.to, item.first + item.rows);
        size_ += item.rows * channels[s];
      }
    if (one.to == 0) one.from = 0;
    span_ = std::max(span_, one.to);
    signals_.push_back(one);
  }
  stride_ = kChunk + span_ - 1 + kCorrelationPadding;
  samples_.assign(static_cast<std::size_t>(channels_ * stride_), 0.0);
  padded_.assign(static_cast<std::size_t>(channels_ * kChunk), 0.0);
  ones_.assign(kChunk, 1.0);
  head_.assign(static_cast<std::size_t>(channels_ * span_), 0.0);
  pairs_.resize(static_cast<std::size_t>(channels_ * channels_));
  totals_.resize(static_cast<std::size_t>(channels_));
  first_row_.resize(totals_.size());
  first_column_.resize(totals_.size());
  first_total_.resize(totals_.size());
  for (Index b = 0; b < channels_; ++b) {
    const Signal& own = signal(signal_of(b));
    const auto at = static_cast<std::size_t>(b);
    totals_[at].reset(own.lags(), precision_);
    first_total_[at].reset(1, precision_);
    first_row_[at].reset((own.first + own.channels) * own.lags(), precision_);
    first_column_[at].reset((channels_ - own.first - own.channels) * std::max<Index>(own.lags() - 1, 0), precision_);
    for (Index a = 0; a < own.first + own.channels; ++a)
      pair(a, b).reset(signal(signal_of(a)).lags() * own.lags(), precision_);
  }
}

void HankelGram::feed(const std::vector<ConstMatrixRef>& chunk) {
  const Index count = chunk.front().cols();
  if (count == 0) return;
  if (shift_.empty()) {
    for (const ConstMatrixRef& signal : chunk) {
      const Vector mean = signal.leftCols(std::min(count, kShiftSamples)).rowwise().mean();
      shift_.insert(shift_.end(), mean.begin(), mean.end());
    }
  }
  for (Index done = 0; done < count;) {
    const Index room = std::min(kChunk + span_ - 1 - held_, count - done);
    for (std::size_t s = 0; s < chunk.size(); ++s)
      for (Index c = 0; c < signals_[s].channels; ++c) {
        const Index all = signals_[s].first + c;
        const double shift = shift_[static_cast<std::size_t>(all)];
        double* const target = channel(all) + held_;
        const double* const source = &chunk[s].coeffRef(c, done);
        const Index step = chunk[s].outerStride();
        for (Index k = 0; k < room; ++k) target[k] = source[k * step] - shift;
      }
    held_ += room;
    done += room;
    if (held_ == kChunk + span_ - 1) process(kChunk);
  }
}

void HankelGram::correlate(const std::vector<const double*>& fixed, const double* moving, Index lags, Index count,
                           Sums& sums) {
  if (fixed.empty() || lags <= 0) return;
  const auto number = static_cast<Index>(fixed.size());
  if (precision_ == Precision::plain)
    add_correlations(fixed.data(), number, moving, lags, count, sums.high.data());
  else
    add_correlations_extended(fixed.data(), number, moving, lags, count, sums.high.data(), sums.low.data());
}

/// Adds the products of the first `count` columns held and lets go of their first samples.
void HankelGram::process(Index count) {
  if (record_columns_ == 0)
    for (Index c = 0; c < channels_; ++c) std::copy_n(channel(c), span_ - 1, head_.data() + c * span_);
  const bool whole = count % kCorrelationPadding == 0;
  std::vector<const double*> fixed(static_cast<std::size_t>(channels_)), some;
  for (Index c = 0; c < channels_; ++c) {
    const double* const own = channel(c) + signal(signal_of(c)).from;
    double* const copy = padded_.data() + c * kChunk;
    if (!whole) {
      std::copy_n(own, count, copy);
      std::fill(copy + count, copy + std::min(kChunk, count + kCorrelationPadding), 0.0);
    }
    fixed[static_cast<std::size_t>(c)] = whole ? own : copy;
  }
  if (!whole) std::fill(ones_.begin() + count, ones_.end(), 0.0);
  for (Index c = 0; c < channels_; ++c) {
    const Signal& own = signal(signal_of(c));
    if (own.lags() == 0) continue;
    const auto at = static_cast<std::size_t>(c);
    const auto end = fixed.begin() + own.first + own.channels;
    some.assign(fixed.begin(), end);
    correlate(some, channel(c) + own.from, own.lags(), count, first_row_[at]);
    some.assign(end, fixed.end());
    correlate(some, channel(c) + own.from + 1, own.lags() - 1, count, first_column_[at]);
    correlate({ones_.data()}, channel(c) + own.from, 1, count, first_total_[at]);
  }
  if (!whole) std::fill(ones_.begin(), ones_.end(), 1.0);
  for (Index c = 0; c < channels_; ++c)
    std::memmove(channel(c), channel(c) + count, static_cast<std::size_t>(held_ - count) * sizeof(double));
  held_ -= count;
  record_columns_ += count;
}

void HankelGram::add_record(Index A, Index a, Index B, Index b) {
  const Signal &first = signal(A), &second = signal(B);
  const Index n = first.lags(), width = second.lags();
  const Sums &row = first_row_[static_cast<std::size_t>(b)], &column = first_column_[static_cast<std::size_t>(a)];
  Sums& total = pair(a, b);
  const bool extended = precision_ == Precision::extended;
  std::vector<double> now_high(static_cast<std::size_t>(width)), now_low(now_high.size());
  const double *const a_head = head_.data() + a * span_ + first.from, *const a_tail = channel(a) + first.from;
  const double *const b_head = head_.data() + b * span_ + second.from, *const b_tail = channel(b) + second.from;
  for (Index i = 0; i < n; ++i) {
    if (i == 0) {
      for (Index j = 0; j < width; ++j) {
        now_high[static_cast<std::size_t>(j)] = row.high[static_cast<std::size_t>(a * width + j)];
        if (extended) now_low[static_cast<std::size_t>(j)] = row.low[static_cast<std::size_t>(a * width + j)];
      }
    } else {
      double *const high = now_high.data(), *const low = now_low.data();
      const double ah = a_head[i - 1], at = a_tail[i - 1];
      const Index least = A == B ? i : 1;
      if (extended) {
        for (Index j = width - 1; j >= least; --j) {
          const DoubleDouble before{high[j - 1], low[j - 1]};
          const DoubleDouble next = before + -two_product(ah, b_head[j - 1]) + two_product(at, b_tail[j - 1]);
          high[j] = next.high;
          low[j] = next.low;
        }
      } else {
        for (Index j = width - 1; j >= least; --j) high[j] = (high[j - 1] - ah * b_head[j - 1]) + at * b_tail[j - 1];
      }
      if (A != B) {
        const auto from = static_cast<std::size_t>((b - first.first - first.channels) * (n - 1) + i - 1);
        high[0] = column.high[from];
        if (extended) low[0] = column.low[from];
      }
    }
    const auto at_row = static_cast<std::size_t>(i * width);
    for (Index j = A == B ? i : 0; j < width; ++j) {
      const std::size_t to = at_row + static_cast<std::size_t>(j), from = static_cast<std::size_t>(j);
      if (extended) {
        const DoubleDouble sum =
            DoubleDouble{total.high[to], total.low[to]} + DoubleDouble{now_high[from], now_low[from]};
        total.high[to] = sum.high;
        total.low[to] = sum.low;
      } else {
        total.high[to] += now_high[from];
      }
    }
  }
}

void HankelGram::end_record() {
  if (held_ >= span_) process(held_ - span_ + 1);
  if (record_columns_ > 0) {
    for (Index b = 0; b < channels_; ++b) {
      const Index B = signal_of(b);
      const Signal& own = signal(B);
      for (Index a = 0; a < own.first + own.channels; ++a) add_record(signal_of(a), a, B, b);
      const auto at = static_cast<std::size_t>(b);
      const double *const head = head_.data() + b * span_ + own.from, *const tail = channel(b) + own.from;
      DoubleDouble sum{first_total_[at].high[0], precision_ == Precision::extended ? first_total_[at].low[0] : 0};
      for (Index l = 0; l < own.lags(); ++l) {
        const auto lag = static_cast<std::size_t>(l);
        if (l > 0) sum = sum + DoubleDouble{-head[l - 1], 0} + DoubleDouble{tail[l - 1], 0};
        const DoubleDouble before{totals_[at].high[lag], precision_ == Precision::extended ? totals_[at].low[lag] : 0};
        const DoubleDouble after = before + sum;
        totals_[at].high[lag] = after.high;
        if (precision_ == Precision::extended) totals_[at].low[lag] = after.low;
      }
    }
    columns_ += record_columns_;
  }
  record_columns_ = held_ = 0;
  for (auto* const group : {&first_row_, &first_column_, &first_total_})
    for (Sums& sums : *group) sums.reset(static_cast<Index>(sums.high.size()), precision_);
}

std::optional<GramFactor> HankelGram::factor() const {
  const bool extended = precision_ == Precision::extended;
  struct Row {
    Index channel, lag;
  };
  std::vector<Row> order;
  for (const HankelRows& item : rows_)
    for (Index l = 0; l < item.rows; ++l)
      for (Index c = 0; c < signal(item.signal).channels; ++c)
        order.push_back({signal(item.signal).first + c, item.first + l - signal(item.signal).from});
  // Rows scaled to a size between 1 and 2 by powers of two, which cost no digits.
  Vector scale(size_);
  for (Index i = 0; i < size_; ++i) {
    double square = static_cast<double>(columns_);
    if (i > 0) {
      const auto [c, lag] = order[static_cast<std::size_t>(i - 1)];
      square = pair(c, c).high[static_cast<std::size_t>(lag * (signal(signal_of(c)).lags() + 1))];
    }
    if (!(square > 0) || !std::isfinite(square)) return {};
    scale(i) = std::exp2(-std::floor(0.5 * std::log2(square)));
  }
  const Index stored = cholesky_stride(size_);
  Matrix high(stored, size_), low;
  if (extended) low = Matrix::Zero(stored, size_);
  // The factorisation reads whole groups of rows, so that those above the diagonal or below the last row must be
  // finite.
  for (Index j = 0; j < size_; ++j) {
    high.col(j).segment(j / kCholeskyRows * kCholeskyRows, j % kCholeskyRows).setZero();
    high.col(j).tail(stored - size_).setZero();
  }
  high(0, 0) = static_cast<double>(columns_) * scale(0) * scale(0);
  // The products of one row with all rows of a channel, `step` apart.
  struct Line {
    const double *high = nullptr, *low = nullptr;
    Index step = 0;
  };
  // A pair is stored once, its first row that of the earlier signal or, in one signal, of the smaller lag.
  std::vector<Line> as_first(static_cast<std::size_t>(channels_)), as_second(as_first.size());
  for (Index j = 1; j < size_; ++j) {
    const auto [own, lag] = order[static_cast<std::size_t>(j - 1)];
    const Sums& total = totals_[static_cast<std::size_t>(own)];
    high(j, 0) = total.high[static_cast<std::size_t>(lag)] * (scale(0) * scale(j));
    if (extended) low(j, 0) = total.low[static_cast<std::size_t>(lag)] * (scale(0) * scale(j));
    const Index Y = signal_of(own);
    for (Index c = 0; c < channels_; ++c) {
      const Index X = signal_of(c);
      const auto at = static_cast<std::size_t>(c);
      const auto line = [&](const Sums& sums, Index first, Index step) {
        return Line{sums.high.data() + first, extended ? sums.low.data() + first : nullptr, step};
      };
      if (X <= Y) as_first[at] = line(pair(c, own), lag, signal(Y).lags());
      if (X >= Y) as_second[at] = line(pair(own, c), lag * signal(X).lags(), 1);
      if (X < Y) as_second[at] = as_first[at];
      if (X > Y) as_first[at] = as_second[at];
    }
    for (Index i = j; i < size_; ++i) {
      const auto [c, other] = order[static_cast<std::size_t>(i - 1)];
      const Line& line = (other > lag ? as_second : as_first)[static_cast<std::size_t>(c)];
      const double both = scale(i) * scale(j);
      high(i, j) = line.high[other * line.step] * both;
      if (extended) low(i, j) = line.low[other * line.step] * both;
    }
  }
  // A pivot of the size of its own rounding errors is that of a row which follows from those above it.
  if (!(extended ? cholesky_extended(high, low, static_cast<double>(size_) * kExtendedSum) : cholesky_plain(high)))
    return {};
  GramFactor result;
  result.error = std::max(kEps, diagonal_error(high.topRows(size_), extended ? kExtendedSum : kPlainSum));
  scale = scale.cwiseInverse();
  result.R.resize(size_, size_);
  for (Index j = 0; j < size_; ++j) {
    result.R.col(j).head(j).setZero();
    result.R.col(j).tail(size_ - j) = high.col(j).segment(j, size_ - j).cwiseProduct(scale.tail(size_ - j));
  }
  // What was taken from the channels goes into the first column, that of the constant row.
  for (Index i = 1; i < size_; ++i)
    result.R(i, 0) += shift_[static_cast<std::size_t>(order[static_cast<std::size_t>(i - 1)].channel)] * result.R(0, 0);
  if (!all_finite(result.R)) return {};
  return result;
}

}  // namespace wheelhop
