#include "experiments/blind/truth/retuning.hpp"

#include <cmath>

namespace wheelhop::blind {

Retuning::Retuning(const TrueSystem& plain, const Playback& playback, const ObserveOptions& options, const Matrix& base,
                   const Vector& sigma, const Vector& off)
    : sigma_(sigma), off_(off), tangents_(base.size(), off.size()) {
  constexpr double step = 0.5;
  for (Index i = 0; i < off.size(); ++i) {
    const Parameter& parameter = plain.plan->parameters[static_cast<std::size_t>(i)];
    const double change = step * parameter.tolerance * parameter.value;
    if (change == 0) {
      tangents_.col(i).setZero();
      continue;
    }
    TrueSystem moved = plain;
    moved.theta(i) += change;
    tangents_.col(i) = scaled(observe(moved, playback, options).clean - base) / step;
  }
  normal_.compute(tangents_.transpose() * tangents_ + Matrix::Identity(off.size(), off.size()));
}

Vector Retuning::scaled(const Matrix& change) const {
  const Matrix over_noise = sigma_.cwiseInverse().asDiagonal() * change;
  return over_noise.reshaped();
}

double Retuning::left_of(const Matrix& change) const {
  const Vector d = scaled(change);
  const Vector c = normal_.solve(off_ - tangents_.transpose() * d);
  return std::sqrt((d + tangents_ * c).squaredNorm() / static_cast<double>(d.size()));
}

double Retuning::delivered(const Matrix& change) const {
  const Vector d = scaled(change);
  return std::sqrt((d + tangents_ * off_).squaredNorm() / static_cast<double>(d.size()));
}

}  // namespace wheelhop::blind
