/// \file
/// What re-tuning a plant inside its tolerances cannot remove from a change of its outputs.
#pragma once

#include <Eigen/Cholesky>

#include "experiments/rig/system.hpp"

namespace wheelhop::blind {

class Retuning {
 public:
  /// Tangents of the outputs in tolerances, by forward differences of half a tolerance about the true parameters.
  /// @param plain the system without effect; it and the playback are kept by reference
  /// @param base its outputs   @param sigma p standard deviations of the noise
  /// @param off true parameters in tolerances off the delivered ones, as drawn
  Retuning(const TrueSystem& plain, const Playback& playback, const ObserveOptions& options, const Matrix& base,
           const Vector& sigma, const Vector& off);

  /// min over c of |base + change - y(true - c)|^2 + |off - c|^2, both in units of noise and tolerances (the second is
  /// the prior about the delivered values); tells the first term as RMS over the noise's. Each round simulates the
  /// plant that the tangents suggest and is taken where it is better. @param change p x N of the outputs
  double left_of(const Matrix& change, int rounds) const;
  /// What the plant as delivered leaves of base + change.
  double delivered(const Matrix& change) const;
  /// What re-tuning all other parameters leaves of the outputs `base` where this one stays as delivered, by the
  /// tangents alone: how much of a wrong parameter the others cannot take over.
  double left_holding(Index parameter) const;

 private:
  Vector scaled(const Matrix& change) const;
  /// base + change - y(true - c), scaled.
  Vector misfit(const Matrix& change, const Vector& c) const;

  const TrueSystem& plain_;
  const Playback& playback_;
  ObserveOptions options_;
  Matrix base_;
  Vector sigma_, off_, tolerance_;
  Matrix tangents_;  ///< (p N) x parameters
  Eigen::LDLT<Matrix> normal_;
};

}  // namespace wheelhop::blind
