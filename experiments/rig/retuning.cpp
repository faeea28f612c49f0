#include "experiments/rig/retuning.hpp"

#include <cmath>

namespace wheelhop::blind {
namespace {

double rms(const Vector& values) { return std::sqrt(values.squaredNorm() / static_cast<double>(values.size())); }

}  // namespace

Retuning::Retuning(const TrueSystem& plain, const Playback& playback, const ObserveOptions& options, const Matrix& base,
                   const Vector& sigma, const Vector& off)
    : plain_(plain),
      playback_(playback),
      options_(options),
      base_(base),
      sigma_(sigma),
      off_(off),
      tolerance_(off.size()),
      tangents_(base.size(), off.size()) {
  constexpr double step = 0.5;
  for (Index i = 0; i < off.size(); ++i) {
    const Parameter& parameter = plain.plan->parameters[static_cast<std::size_t>(i)];
    tolerance_(i) = parameter.tolerance * parameter.value;
    if (tolerance_(i) == 0)
      tangents_.col(i).setZero();
    else
      tangents_.col(i) = -misfit(Matrix::Zero(base.rows(), base.cols()), -step * Vector::Unit(off.size(), i)) / step;
  }
  normal_.compute(tangents_.transpose() * tangents_ + Matrix::Identity(off.size(), off.size()));
}

Vector Retuning::scaled(const Matrix& change) const {
  const Matrix over_noise = sigma_.cwiseInverse().asDiagonal() * change;
  return over_noise.reshaped();
}

Vector Retuning::misfit(const Matrix& change, const Vector& c) const {
  TrueSystem moved = plain_;
  moved.theta -= c.cwiseProduct(tolerance_);
  return scaled(base_ + change - observe(moved, playback_, options_).clean);
}

double Retuning::left_of(const Matrix& change, int rounds) const {
  Vector c = Vector::Zero(off_.size()), left = scaled(change);
  const auto cost = [&](const Vector& at, const Vector& misfit) {
    return misfit.squaredNorm() + (off_ - at).squaredNorm();
  };
  for (int round = 0; round < rounds; ++round) {
    Vector step = normal_.solve(off_ - c - tangents_.transpose() * left);
    bool better = false;
    // A step that leaves the plant's laws, or makes things worse, is halved.
    for (int halving = 0; halving < 3 && !better; ++halving, step /= 2) {
      Vector trial;
      try {
        trial = misfit(change, c + step);
      } catch (const RigFailure&) {
        continue;
      }
      better = cost(c + step, trial) < cost(c, left);
      if (!better) continue;
      c += step;
      left = std::move(trial);
    }
    if (!better) break;
  }
  return rms(left);
}

double Retuning::left_holding(Index parameter) const {
  const Index n = off_.size();
  // Pulled to the delivered value with all its weight, the parameter stays there.
  constexpr double held = 1e12;
  Matrix normal = tangents_.transpose() * tangents_ + Matrix::Identity(n, n);
  Vector pull = off_;
  const double weight = held * normal(parameter, parameter);
  normal(parameter, parameter) += weight;
  pull(parameter) += weight * off_(parameter);
  return rms(tangents_ * Eigen::LDLT<Matrix>(normal).solve(pull));
}

double Retuning::delivered(const Matrix& change) const { return rms(misfit(change, off_)); }

}  // namespace wheelhop::blind
