/// \file
/// Gram matrix of a stack of block-Hankel matrices, and its triangular factor, in plain or in twice the precision.
#pragma once

#include <optional>
#include <vector>

#include "core/base/linalg.hpp"

namespace wheelhop {

enum class Precision {
  plain,     ///< double
  extended,  ///< twice that
};

/// Rows of the stack: column k holds samples k + first .. k + first + rows - 1 of a signal, all its channels of one
/// sample before the next.
struct HankelRows {
  Index signal, first, rows;
};

/// Lower triangular factor of the stack, diagonal positive, and how well it is known.
struct GramFactor {
  Matrix R;
  /// Estimate of the largest relative error of what a row adds to those above it, max_i |dR_ii / R_ii|; a row all of
  /// which follows from those above it has none that is known.
  double error = 0;
};

/// Collects the Gram matrix of [1; rows] over records that arrive in chunks.
///
/// Neighbouring columns of a Hankel matrix share all but one sample, so that
///   G(i + 1, j + 1) = G(i, j) - a(i) b(j) + a(c + i) b(c + j)
/// over c columns, for the products of two channels a and b at lags i and j: the first row and column of lags are
/// summed over the record, the others follow. The mean of the first samples is taken from each channel, which the
/// constant row makes up for exactly, so that an offset costs no digits.
///
/// Memory O(L^2) and one chunk, L = 1 + all rows times channels; cost O(N c^2 s) for c channels and s lags, against
/// O(N L^2) of an orthogonal factorisation. Source of the displacement: Kailath & Sayed 1995; of its use here:
/// Mastronardi, Kressner, Sima, Van Dooren & Van Huffel 2001.
class HankelGram {
 public:
  /// @param channels of every signal   @param rows of the stack below the constant row, in order
  HankelGram(std::vector<Index> channels, std::vector<HankelRows> rows, Precision precision);

  /// The next samples of the current record. @param chunk one channels x count matrix a signal
  void feed(const std::vector<ConstMatrixRef>& chunk);
  /// The next samples belong to another record: no column spans both. A record shorter than a column adds nothing.
  void end_record();

  Index columns() const { return columns_; }  ///< of the records that have ended
  Index size() const { return size_; }        ///< L

  /// Factor of what the ended records hold, R R' = G, by Cholesky's method in the precision of the sums.
  /// @return none where a pivot is lost: a row follows from those above it to the last digit, or a sum is not finite
  std::optional<GramFactor> factor() const;

 private:
  struct Signal {
    Index channels = 0, first = 0;  ///< position of its channels among all
    Index from = 0, to = 0;         ///< lags that occur, [from, to)
    Index lags() const { return to - from; }
  };
  /// Sums in the precision asked for: high + low.
  struct Sums {
    std::vector<double> high, low;
    void reset(Index count, Precision precision);
  };

  void process(Index count);
  void correlate(const std::vector<const double*>& fixed, const double* moving, Index lags, Index count, Sums& sums);
  void add_record(Index A, Index a, Index B, Index b);
  double* channel(Index c) { return samples_.data() + c * stride_; }
  Sums& pair(Index a, Index b) { return pairs_[static_cast<std::size_t>(a * channels_ + b)]; }
  const Sums& pair(Index a, Index b) const { return pairs_[static_cast<std::size_t>(a * channels_ + b)]; }
  Index signal_of(Index c) const { return signal_of_[static_cast<std::size_t>(c)]; }
  const Signal& signal(Index A) const { return signals_[static_cast<std::size_t>(A)]; }

  Precision precision_;
  std::vector<Signal> signals_;
  std::vector<HankelRows> rows_;
  std::vector<Index> signal_of_;  ///< of a channel
  Index size_ = 1, channels_ = 0, span_ = 0, stride_ = 0;
  /// Of all records that have ended, for channels a and b of signals A <= B: lags of A x lags of B, row-major; for
  /// A = B the upper triangle.
  std::vector<Sums> pairs_;
  std::vector<Sums> totals_;  ///< of a channel: its sum at every lag of its signal
  Index columns_ = 0;

  // The current record. Of pairs with b as the second channel the first row of lags, a the channels of signals up to
  // that of b; of pairs with a as the first channel the first column, b the channels of later signals; the first sum.
  std::vector<Sums> first_row_, first_column_, first_total_;
  std::vector<double> shift_;  ///< taken from every channel of all records; empty before the first sample
  std::vector<double> head_;   ///< first samples of every channel
  std::vector<double> samples_, ones_, padded_;
  Index held_ = 0, record_columns_ = 0;
};

}  // namespace wheelhop
