#include "core/data/noise.hpp"

#include <cmath>
#include <limits>
#include <stdexcept>

#include "core/data/metrics.hpp"

namespace wheelhop {

Vector add_noise(Signal& signal, double snr_db, Random& random) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  if (std::isnan(snr_db) || snr_db == -infinity)
    throw std::invalid_argument("add_noise: the signal-to-noise ratio must be a number of dB");
  if (snr_db == infinity || signal.y.cols() == 0) return Vector::Zero(signal.y.rows());
  const Vector deviation = rms(signal.y) * std::pow(10.0, -snr_db / 20);
  signal.y += deviation.asDiagonal() * random.normal(signal.y.rows(), signal.y.cols());
  return deviation;
}

}  // namespace wheelhop
