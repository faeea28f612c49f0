#include "core/data/resample.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace wheelhop {
namespace {

constexpr Index kHalfWidth = 32;      // samples either side
constexpr double kKaiserBeta = 14.5;  // side lobes 140 dB down
constexpr Index kStoredPhases = 4096;
// Half the width of the window's transition, in half sampling rates: (140 - 8) / (2.285 * 64 pi) (Kaiser's formula), so
// that the stopband begins at half the lower rate.
constexpr double kStopShare = 1 - 0.14;

/// Modified Bessel function of the first kind, order 0, by its power series (all terms positive, so no cancellation).
double bessel_i0(double x) {
  double term = 1, sum = 1;
  for (int k = 1; k < 200 && term > 1e-17 * sum; ++k) {
    term *= (x / (2 * k)) * (x / (2 * k));
    sum += term;
  }
  return sum;
}

/// Weights of samples -31 ... 32 (counted from the one before) for a point `phase` in (0, 1) behind that sample.
Vector sinc_weights(double phase) {
  Vector weights(2 * kHalfWidth);
  for (Index j = 0; j < weights.size(); ++j) {
    const double x = phase - static_cast<double>(j - kHalfWidth + 1);
    const double edge = x / static_cast<double>(kHalfWidth);
    const double window = bessel_i0(kKaiserBeta * std::sqrt(std::max(0.0, 1 - edge * edge)));
    weights(j) = window * std::sin(std::numbers::pi * x) / (std::numbers::pi * x);
  }
  return weights / weights.sum();
}

/// Column k of the record continued beyond both ends by odd reflection about its end points. The continuation repeats
/// with period 2 (N - 1), shifted by twice the rise of the record, so that even one much shorter than the window works.
Vector continued(ConstMatrixRef samples, Index k) {
  const Index last = samples.cols() - 1;
  if (last == 0) return samples.col(0);
  const Index period = 2 * last;
  const Index turns = k >= 0 ? k / period : -((period - 1 - k) / period);
  const Index place = k - turns * period;
  const Vector rise = samples.col(last) - samples.col(0);
  const Vector shift = 2.0 * static_cast<double>(turns) * rise;
  if (place <= last) return samples.col(place) + shift;
  return 2 * samples.col(last) - samples.col(period - place) + shift;
}

Vector between(ConstMatrixRef samples, const Matrix& padded, Index base, double phase, Interpolation kind,
               const Vector& weights) {
  if (phase == 0 || kind == Interpolation::zoh) return samples.col(base);
  if (kind == Interpolation::linear) {
    const Index next = std::min(base + 1, samples.cols() - 1);
    return (1 - phase) * samples.col(base) + phase * samples.col(next);
  }
  // Column 0 of `padded` is sample 1 - half width.
  return padded.middleCols(base, 2 * kHalfWidth) * weights;
}

Matrix pad(ConstMatrixRef samples) {
  const Index n = samples.cols();
  Matrix padded(samples.rows(), n + 2 * kHalfWidth - 1);
  padded.middleCols(kHalfWidth - 1, n) = samples;
  for (Index j = 0; j < kHalfWidth - 1; ++j) padded.col(j) = continued(samples, j - kHalfWidth + 1);
  for (Index j = 0; j < kHalfWidth; ++j) padded.col(kHalfWidth - 1 + n + j) = continued(samples, n + j);
  return padded;
}

/// Smallest up, down <= limit with up / down equal to `ratio` to rounding (continued fraction); {0, 0} if there are
/// none.
struct Fraction {
  Index up = 0, down = 0;
};
Fraction fraction_of(double ratio, Index limit) {
  double rest = ratio;
  Index up = 1, down = 0, up_before = 0, down_before = 1;
  for (int i = 0; i < 40; ++i) {
    const double whole = std::floor(rest);
    if (whole > static_cast<double>(limit)) return {};
    const auto digit = static_cast<Index>(whole);
    const Index next_up = digit * up + up_before, next_down = digit * down + down_before;
    if (next_up > limit || next_down > limit) return {};
    up_before = up;
    down_before = down;
    up = next_up;
    down = next_down;
    if (std::abs(static_cast<double>(up) / static_cast<double>(down) - ratio) <= 4e-15 * ratio) return {up, down};
    rest = 1 / (rest - whole);
  }
  return {};
}

Matrix interpolate_fraction(ConstMatrixRef samples, Fraction ratio, Index count, Interpolation kind) {
  const bool sinc = kind == Interpolation::band_limited;
  const Matrix padded = sinc ? pad(samples) : Matrix();
  std::vector<Vector> weights(static_cast<std::size_t>(ratio.up));
  Matrix result(samples.rows(), count);
  for (Index k = 0; k < count; ++k) {
    const Index base = k * ratio.down / ratio.up;
    const Index step = k * ratio.down % ratio.up;
    const double phase = static_cast<double>(step) / static_cast<double>(ratio.up);
    Vector& phase_weights = weights[static_cast<std::size_t>(step)];
    if (sinc && step != 0 && phase_weights.size() == 0) phase_weights = sinc_weights(phase);
    result.col(k) = between(samples, padded, base, phase, kind, phase_weights);
  }
  return result;
}

Matrix interpolate_real(ConstMatrixRef samples, double ratio, Index count, Interpolation kind) {
  const bool sinc = kind == Interpolation::band_limited;
  const Matrix padded = sinc ? pad(samples) : Matrix();
  Matrix result(samples.rows(), count);
  for (Index k = 0; k < count; ++k) {
    const double time = static_cast<double>(k) / ratio;
    const Index base = std::min(static_cast<Index>(time), samples.cols() - 1);
    const double phase = time - static_cast<double>(base);
    result.col(k) = between(samples, padded, base, phase, kind, sinc && phase != 0 ? sinc_weights(phase) : Vector());
  }
  return result;
}

/// Weights of the samples from `first` on for a point at `place`, with nothing above `cutoff` half sampling rates.
Vector low_pass_weights(double place, double cutoff, Index first, Index count) {
  const double half = static_cast<double>(kHalfWidth) / cutoff;
  Vector weights(count);
  for (Index j = 0; j < count; ++j) {
    const double x = place - static_cast<double>(first + j);
    const double window = bessel_i0(kKaiserBeta * std::sqrt(std::max(0.0, 1 - (x / half) * (x / half))));
    const double angle = std::numbers::pi * cutoff * kStopShare * x;
    weights(j) = window * (std::abs(angle) < 1e-9 ? 1 : std::sin(angle) / angle);
  }
  return weights / weights.sum();
}

/// @param ratio to_hz / from_hz < 1
Matrix reduce(ConstMatrixRef samples, double ratio, Index count) {
  const auto reach = static_cast<Index>(std::ceil(static_cast<double>(kHalfWidth) / ratio));
  const Index n = samples.cols();
  Matrix padded(samples.rows(), n + 2 * reach);
  padded.middleCols(reach, n) = samples;
  for (Index j = 0; j < reach; ++j) {
    padded.col(j) = continued(samples, j - reach);
    padded.col(reach + n + j) = continued(samples, n + j);
  }
  const Fraction fraction = fraction_of(ratio, kStoredPhases);
  std::vector<Vector> stored(static_cast<std::size_t>(fraction.up));
  Matrix result(samples.rows(), count);
  for (Index k = 0; k < count; ++k) {
    const double place = static_cast<double>(k) / ratio;
    const Index base = fraction.up > 0 ? k * fraction.down / fraction.up : static_cast<Index>(place);
    Vector own;
    Vector& weights = fraction.up > 0 ? stored[static_cast<std::size_t>(k * fraction.down % fraction.up)] : own;
    if (weights.size() == 0)
      weights = low_pass_weights(place - static_cast<double>(base), ratio, -reach, 2 * reach + 1);
    result.col(k) = padded.middleCols(base, 2 * reach + 1) * weights;
  }
  return result;
}

}  // namespace

Matrix decimate(ConstMatrixRef samples, Index factor) {
  if (factor < 1) throw std::invalid_argument("decimate: factor must be at least 1");
  Matrix result(samples.rows(), (samples.cols() + factor - 1) / factor);
  for (Index k = 0; k < result.cols(); ++k) result.col(k) = samples.col(k * factor);
  return result;
}

const std::vector<std::string>& interpolation_names() {
  static const std::vector<std::string> names = {"band_limited", "zoh", "linear"};
  return names;
}

Interpolation interpolation_from(const std::string& name) {
  if (name == "band_limited") return Interpolation::band_limited;
  if (name == "zoh") return Interpolation::zoh;
  if (name == "linear") return Interpolation::linear;
  throw std::invalid_argument("interpolation_from: no interpolation is called \"" + name + "\"");
}

Matrix interpolate(ConstMatrixRef samples, Index factor, Interpolation kind) {
  if (factor < 1) throw std::invalid_argument("interpolate: factor must be at least 1");
  if (samples.cols() == 0) return samples;
  return interpolate_fraction(samples, {factor, 1}, samples.cols() * factor, kind);
}

Matrix interpolate(ConstMatrixRef samples, double from_hz, double to_hz, Interpolation kind) {
  if (!(from_hz > 0 && to_hz > 0 && std::isfinite(from_hz) && std::isfinite(to_hz)))
    throw std::invalid_argument("interpolate: rates must be positive and finite");
  if (samples.cols() == 0) return samples;
  const double ratio = to_hz / from_hz;
  const Fraction fraction = fraction_of(ratio, kStoredPhases);
  if (fraction.up > 0) {
    const Index count = (samples.cols() * fraction.up + fraction.down - 1) / fraction.down;
    return interpolate_fraction(samples, fraction, count, kind);
  }
  const auto count = static_cast<Index>(std::ceil(static_cast<double>(samples.cols()) * ratio));
  return interpolate_real(samples, ratio, count, kind);
}

Matrix resample(ConstMatrixRef samples, double from_hz, double to_hz) {
  if (!(from_hz > 0 && to_hz > 0 && std::isfinite(from_hz) && std::isfinite(to_hz)))
    throw std::invalid_argument("resample: rates must be positive and finite");
  if (samples.cols() == 0 || from_hz == to_hz) return samples;
  const double ratio = to_hz / from_hz;
  const auto count = 1 + static_cast<Index>(std::floor(static_cast<double>(samples.cols() - 1) * ratio * (1 + 1e-12)));
  if (ratio < 1) return reduce(samples, ratio, count);
  return interpolate(samples, from_hz, to_hz, Interpolation::band_limited).leftCols(count);
}

}  // namespace wheelhop
