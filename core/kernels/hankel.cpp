#include "core/kernels/hankel.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>

#include "core/kernels/hankel_gram.hpp"
#include "core/kernels/streamed_qr.hpp"

namespace wheelhop {

namespace {

Index columns_of(const std::vector<HankelBlock>& blocks) {
  Index columns = std::numeric_limits<Index>::max();
  for (const HankelBlock& block : blocks)
    columns = std::min(columns, block.signal.cols() - block.first - block.rows + 1);
  return columns;
}

Index rows_of(const std::vector<HankelBlock>& blocks) {
  Index rows = 1;
  for (const HankelBlock& block : blocks) rows += block.signal.rows() * block.rows;
  return rows;
}

std::optional<HankelFactor> from_gram(Precision precision, const std::vector<HankelBlock>& blocks) {
  // Blocks of one signal share its products.
  std::vector<ConstMatrixRef> signals;
  std::vector<Index> channels;
  std::vector<HankelRows> rows;
  Index span = 0;
  for (const HankelBlock& block : blocks) {
    std::size_t s = 0;
    while (s < signals.size() && (signals[s].data() != block.signal.data() || channels[s] != block.signal.rows())) ++s;
    if (s == signals.size()) {
      signals.push_back(block.signal);
      channels.push_back(block.signal.rows());
    }
    rows.push_back({static_cast<Index>(s), block.first, block.rows});
    span = std::max(span, block.first + block.rows);
  }
  HankelGram gram(channels, rows, precision);
  const Index samples = columns_of(blocks) + span - 1;
  std::vector<ConstMatrixRef> used;
  for (const ConstMatrixRef& signal : signals) {
    if (signal.cols() < samples) throw std::invalid_argument("hankel_factor: signals of different lengths");
    used.push_back(signal.leftCols(samples));
  }
  gram.feed(used);
  gram.end_record();
  std::optional<GramFactor> factor = gram.factor();
  if (!factor) return {};
  return HankelFactor{std::move(factor->R),
                      precision == Precision::plain ? FactorMethod::gram : FactorMethod::extended_gram, factor->error};
}

/// The QR of the transpose: each column of the Hankel stack is one row fed to the stream. Signals are stored one column
/// a sample, so the stack of consecutive samples is contiguous memory.
HankelFactor orthogonal(const std::vector<HankelBlock>& blocks) {
  const Index columns = columns_of(blocks);
  StreamedQr stream(rows_of(blocks));
  for (Index first = 0; first < columns;) {
    const Index count = std::min(stream.capacity(), columns - first);
    MatrixRef filled = stream.next(count);
    for (Index k = 0; k < count; ++k) {
      filled(k, 0) = 1;
      Index at = 1;
      for (const HankelBlock& block : blocks) {
        const Index width = block.signal.rows() * block.rows;
        filled.row(k).segment(at, width) =
            block.signal.middleCols(first + k + block.first, block.rows).reshaped().transpose();
        at += width;
      }
    }
    first += count;
  }
  return {stream.finish().transpose(), FactorMethod::orthogonal, 0};
}

}  // namespace

std::string to_string(FactorMethod method) {
  switch (method) {
    case FactorMethod::gram: return "gram";
    case FactorMethod::extended_gram: return "extended_gram";
    case FactorMethod::orthogonal: return "orthogonal";
  }
  return "";
}

std::optional<HankelFactor> hankel_factor_by(FactorMethod method, const std::vector<HankelBlock>& blocks) {
  if (columns_of(blocks) < rows_of(blocks)) throw std::invalid_argument("hankel_factor: fewer columns than rows");
  switch (method) {
    case FactorMethod::gram: return from_gram(Precision::plain, blocks);
    case FactorMethod::extended_gram: return from_gram(Precision::extended, blocks);
    case FactorMethod::orthogonal: break;
  }
  return orthogonal(blocks);
}

HankelFactor hankel_factor(const std::vector<HankelBlock>& blocks) {
  for (const auto& [method, most] :
       {std::pair{FactorMethod::gram, kFactorError}, std::pair{FactorMethod::extended_gram, kExtendedError}})
    if (std::optional<HankelFactor> factor = hankel_factor_by(method, blocks); factor && factor->error <= most)
      return *std::move(factor);
  return *hankel_factor_by(FactorMethod::orthogonal, blocks);
}

HankelRq hankel_rq(ConstMatrixRef u, ConstMatrixRef y, Index future, Index past, bool past_outputs) {
  std::vector<HankelBlock> blocks = {{u, past, future}, {u, 0, past}};
  if (past_outputs) blocks.push_back({y, 0, past});
  blocks.push_back({y, past, future});
  HankelFactor factor = hankel_factor(blocks);
  return {std::move(factor.R),          future,        past,        u.rows(), y.rows(), past_outputs,
          u.cols() - future - past + 1, factor.method, factor.error};
}

Index persistency_of_excitation(ConstMatrixRef u, Index limit, double tolerance) {
  const Index m = u.rows();
  limit = std::min(limit, (u.cols() + 1) / (m + 1));
  if (limit < 1 || !all_finite(u)) return 0;
  StreamedQr stream(m * limit);
  const Index columns = u.cols() - limit + 1;
  for (Index first = 0; first < columns;) {
    const Index count = std::min(stream.capacity(), columns - first);
    MatrixRef block = stream.next(count);
    for (Index k = 0; k < count; ++k) block.row(k) = u.middleCols(first + k, limit).reshaped().transpose();
    first += count;
  }
  const Matrix R = stream.finish();
  // Leading m s columns of R belong to s block rows. Full rank is inherited by leading blocks: bisection.
  Index low = 0, high = limit;
  while (low < high) {
    const Index s = (low + high + 1) / 2;
    const Vector values = singular_values(R.topLeftCorner(m * s, m * s));
    if (values(0) > 0 && values(m * s - 1) > tolerance * values(0))
      low = s;
    else
      high = s - 1;
  }
  return low;
}

}  // namespace wheelhop
