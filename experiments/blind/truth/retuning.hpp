/// \file
/// What re-tuning a plant inside its tolerances cannot remove from a change of its outputs, to first order.
#pragma once

#include <Eigen/Cholesky>

#include "experiments/blind/truth/system.hpp"

namespace wheelhop::blind {

class Retuning {
 public:
  /// Tangents of the outputs in tolerances, by forward differences of half a tolerance about the true parameters.
  /// @param base outputs without effect   @param sigma p standard deviations of the noise
  /// @param off true parameters in tolerances off the delivered ones, as drawn
  Retuning(const TrueSystem& plain, const Playback& playback, const ObserveOptions& options, const Matrix& base,
           const Vector& sigma, const Vector& off);

  /// min over c of |change + T c|^2 + |off - c|^2 (the last: the prior about the delivered values), as RMS over the
  /// noise's. @param change p x N of the outputs
  double left_of(const Matrix& change) const;
  /// RMS over the noise's of change + T off: what the plant as delivered leaves.
  double delivered(const Matrix& change) const;

 private:
  Vector scaled(const Matrix& change) const;
  Vector sigma_, off_;
  Matrix tangents_;  ///< (p N) x parameters
  Eigen::LDLT<Matrix> normal_;
};

}  // namespace wheelhop::blind
