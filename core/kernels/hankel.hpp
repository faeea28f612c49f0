/// \file
/// The RQ factorisation of the paper's eq. (11) on block-Hankel matrices, streamed over the record.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/base/linalg.hpp"

namespace wheelhop {

/// Block rows of a block-Hankel matrix: column k holds samples k + first .. k + first + rows - 1 of a signal.
struct HankelBlock {
  ConstMatrixRef signal;  ///< r x N, borrowed for the call
  Index first, rows;
};

/// How a factor was computed.
enum class FactorMethod {
  gram,           ///< Cholesky's method on the Gram matrix
  extended_gram,  ///< the same in twice the precision
  orthogonal,     ///< Householder reflections of the rows as they stream by
};
std::string to_string(FactorMethod method);

struct HankelFactor {
  Matrix R;  ///< L x L lower triangular, diagonal non-negative
  FactorMethod method = FactorMethod::gram;
  /// Estimate of the largest relative error of what a row adds to those above it (GramFactor); orthogonal: not known,
  /// 0.
  double error = 0;
};

/// Lower-triangular factor R of the stack [1; blocks] = R Q, Q with orthonormal rows.
///
/// Cholesky's method on the Gram matrix squares the condition. What is computed from the factor is noise beyond the
/// rows above, of which a record of N samples says no more than 1/sqrt(N) of itself; the Gram matrix is taken where
/// rounding moves that by less than kFactorError, else one of twice the precision as long as it is better than an
/// orthogonal factorisation (kExtendedError), else the latter: a row then follows from others to the last digit.
/// @param blocks at least one, of signals of one length; as many columns are used as all of them have
/// Memory O(L^2) for L = 1 + sum of r rows, whatever N. Cost: HankelGram, ten times that in twice the precision, O(N
/// L^2) for the orthogonal one. Throws std::invalid_argument if there are fewer columns than L.
HankelFactor hankel_factor(const std::vector<HankelBlock>& blocks);

/// Judgement: three digits better than the 1e-4 to which 1e8 samples tell what noise adds.
inline constexpr double kFactorError = 1e-7;
/// Up to this error the factor in twice the precision is the better one: with v the size of the inverse of the scaled
/// factor its error is 8 eps^2 v^2 where that of reflections is eps v, and they meet at v = 1 / (8 eps).
inline constexpr double kExtendedError = 1.0 / 8;

/// The factor by the method named. @return none where the Gram matrix has lost a pivot
std::optional<HankelFactor> hankel_factor_by(FactorMethod method, const std::vector<HankelBlock>& blocks);

/// Lower-triangular factor of  [1; U_future; U_past; Y_past; Y_future],  eq. (11) with the constant row of Remark 1.
/// The paper's instruments are past inputs alone: Y_past is left out unless asked for.
struct HankelRq {
  Matrix R;          ///< L x L lower triangular, L = known() + instruments() + p s
  Index future = 0;  ///< s, block rows of the future
  Index past = 0;    ///< s_past
  Index m = 0, p = 0;
  bool past_outputs = false;
  Index columns = 0;  ///< samples that entered
  FactorMethod method = FactorMethod::gram;
  double error = 0;  ///< of HankelFactor

  Index known() const { return 1 + m * future; }                              ///< rows of [1; U_future]
  Index instruments() const { return (past_outputs ? m + p : m) * past; }     ///< rows of [U_past; Y_past]
  Index outputs() const { return p * future; }                                ///< rows of Y_future
  Matrix R22() const { return block(known(), known(), m * past, m * past); }  ///< U_past beyond [1; U_future]
  /// The instruments beyond [1; U_future], square.
  Matrix Rww() const { return block(known(), known(), instruments(), instruments()); }
  /// Y_future along the instruments.
  Matrix R32() const { return block(known() + instruments(), known(), outputs(), instruments()); }
  /// Y_future beyond everything else, square.
  Matrix R33() const { return block(known() + instruments(), known() + instruments(), outputs(), outputs()); }

 private:
  Matrix block(Index row, Index column, Index rows, Index count) const { return R.block(row, column, rows, count); }
};

/// @param u m x N   @param y p x N   @param future s   @param past s_past   @param past_outputs Y_past among the rows
/// Memory and cost as hankel_factor(). Throws std::invalid_argument if N < future + past - 1 + L.
HankelRq hankel_rq(ConstMatrixRef u, ConstMatrixRef y, Index future, Index past, bool past_outputs = false);

/// Order of persistency of excitation of u: the largest s <= `limit` for which the block-Hankel matrix of s block rows
/// has full row rank relative to `tolerance` (smallest over largest singular value). A constant input has order 1 (0
/// if it is zero), a single sine 2. Cost O(N m^2 limit^2).
Index persistency_of_excitation(ConstMatrixRef u, Index limit, double tolerance = 1e-12);

}  // namespace wheelhop
