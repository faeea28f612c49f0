/// \file
/// Interfaces of the swappable pieces of the pipeline: subspace estimation and input reconstruction. (The static map's
/// stands in core/model/static_map.hpp, the solver's in core/optimise/solver.hpp.) Signals arrive scaled to unit RMS a
/// channel; pieces never score themselves.
#pragma once

#include <string>

#include "core/base/status.hpp"
#include "core/model/linear.hpp"

namespace wheelhop {

/// A linear model of a record together with the evidence for its order.
struct LinearEstimate {
  Status status = Status::failed;
  std::string message;
  LinearModel model;
  Vector x0;               ///< n initial state of the record
  Vector singular_values;  ///< those the order was read from, descending
  Index order_given = 0;   ///< 0: automatic
  Index order_used = 0;
  double gap = 0;                   ///< singular value of the order over the next one
  bool stabilised = false;          ///< poles on or outside the unit circle were reflected
  double spectral_radius = 0;       ///< of A as returned
  double condition = 0;             ///< of the least squares for B, D, x0, y0
  Index instruments = 0;            ///< directions of the instruments that were used; 0 where a method has none
  double instrument_condition = 0;  ///< largest over smallest singular value of these directions
  std::string factor;               ///< how the block-Hankel matrix was factored: a `FactorMethod` as text
  double factor_error = 0;          ///< estimated relative error of its rows, see HankelFactor::error
};

/// What a record must offer an estimator.
struct RecordNeeds {
  Index samples = 0;     ///< at least so many
  Index excitation = 0;  ///< order of persistency of excitation of the input, at least
  std::string because;   ///< what asks for it, for messages: "30 + 60 block rows"
};

/// Step 1 of Sec. 2.7.
class SubspaceEstimator {
 public:
  virtual ~SubspaceEstimator() = default;
  virtual std::string name() const = 0;
  /// @param inputs m >= 1   @param outputs p >= 1
  virtual RecordNeeds needs(Index inputs, Index outputs) const = 0;
  /// @param u m x N   @param y p x N   @param order n >= 1, or 0 to read it from the singular values
  /// Status: rank_deficient if the data do not carry the order (too few samples, input not exciting), with the numbers.
  virtual LinearEstimate identify(ConstMatrixRef u, ConstMatrixRef y, Index order) const = 0;
};

/// The auxiliary input of eq. (5) reconstructed from the linear residual.
struct Reconstruction {
  Status status = Status::failed;
  std::string message;
  Matrix f;                    ///< q x N; column k belongs to sample k - delay
  Index delay = 0;             ///< samples by which a method cannot help being late; without_delay() undoes it
  Index first = 0, last = 0;   ///< columns [first, last) that are trustworthy; nothing is fitted to the others
  double input_variance = 0;   ///< Q_eta used (ratio to R_v's scale), 0 where the method has none
  double log_likelihood = 0;   ///< of the innovations, common scale concentrated out; 0 where the method has none
  double spectral_radius = 0;  ///< of the inverse system
};

/// Step 3 of Sec. 2.7: find f with  x_{k+1} = A x_k + Bt f_k,  z_k = C x_k + Dt f_k + v_k.
class InputReconstructor {
 public:
  virtual ~InputReconstructor() = default;
  virtual std::string name() const = 0;
  /// @param A n x n  @param C p x n  @param Bt n x q  @param Dt p x q  @param z p x N linear residual
  /// @param noise_std p, relative weights of the channels' errors (sensor noise and model error)
  virtual Reconstruction reconstruct(ConstMatrixRef A, ConstMatrixRef C, ConstMatrixRef Bt, ConstMatrixRef Dt,
                                     ConstMatrixRef z, ConstVectorRef noise_std) const = 0;
};

/// The same with column k of f at sample k: f moved forward by the delay, the trustworthy range with it. The samples
/// that become free at the end repeat the last one and are not trustworthy.
Reconstruction without_delay(Reconstruction late);

}  // namespace wheelhop
