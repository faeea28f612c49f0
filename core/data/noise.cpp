#include "core/data/noise.hpp"

#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "core/data/metrics.hpp"

namespace wheelhop {

Vector add_noise(Signal& signal, double snr_db, Random& random, std::optional<double> corner_hz) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  if (std::isnan(snr_db) || snr_db == -infinity)
    throw std::invalid_argument("add_noise: the signal-to-noise ratio must be a number of dB");
  if (snr_db == infinity || signal.y.cols() == 0) return Vector::Zero(signal.y.rows());
  const Vector deviation = rms(signal.y) * std::pow(10.0, -snr_db / 20);
  Matrix noise = random.normal(signal.y.rows(), signal.y.cols());
  if (corner_hz) {
    const double a = std::exp(-2 * std::numbers::pi * *corner_hz * signal.sample_time_s), b = std::sqrt(1 - a * a);
    for (Index k = 1; k < noise.cols(); ++k) noise.col(k) = a * noise.col(k - 1) + b * noise.col(k);
  }
  signal.y += deviation.asDiagonal() * noise;
  return deviation;
}

}  // namespace wheelhop
