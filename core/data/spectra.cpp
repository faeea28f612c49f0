#include "core/data/spectra.hpp"

#include <cmath>
#include <complex>
#include <numbers>
#include <stdexcept>
#include <unsupported/Eigen/FFT>
#include <vector>

namespace wheelhop {
namespace {

using Complex = std::complex<double>;
using Line = std::vector<Complex>;

Index largest_prime_factor(Index n) {
  Index largest = 1;
  for (Index p = 2; p * p <= n; ++p)
    for (; n % p == 0; n /= p) largest = p;
  return n > 1 ? n : largest;
}

/// Complex transform of one length. Lengths with a large prime factor, where the mixed-radix transform is quadratic, go
/// through a chirp convolution of a power of two (Bluestein 1970).
class Transform {
 public:
  explicit Transform(Index n) : n_(static_cast<std::size_t>(n)) {
    if (largest_prime_factor(n) <= 100) return;
    std::size_t padded = 1;
    while (padded < 2 * n_ - 1) padded *= 2;
    chirp_.resize(n_);
    kernel_.assign(padded, 0);
    for (std::size_t k = 0; k < n_; ++k) {
      // k^2 modulo 2 n keeps the angle small, where sine and cosine are exact to rounding.
      const double angle = std::numbers::pi * static_cast<double>(k * k % (2 * n_)) / static_cast<double>(n_);
      chirp_[k] = std::polar(1.0, -angle);
      kernel_[k] = kernel_[(padded - k) % padded] = std::conj(chirp_[k]);
    }
    kernel_ = plain(kernel_);
  }

  Line forward(const Line& x) {
    if (chirp_.empty()) return plain(x);
    Line a(kernel_.size(), 0);
    for (std::size_t k = 0; k < n_; ++k) a[k] = x[k] * chirp_[k];
    a = plain(a);
    for (std::size_t k = 0; k < a.size(); ++k) a[k] *= kernel_[k];
    Line b;
    engine_.inv(b, a);
    b.resize(n_);
    for (std::size_t k = 0; k < n_; ++k) b[k] *= chirp_[k];
    return b;
  }

 private:
  Line plain(const Line& x) {
    Line result;
    if (x.size() == 1) return x;
    engine_.fwd(result, x);
    return result;
  }

  std::size_t n_;
  Eigen::FFT<double> engine_;
  Line chirp_, kernel_;
};

}  // namespace

ComplexMatrix fft(ConstMatrixRef x) {
  const Index n = x.cols();
  if (n == 0) throw std::invalid_argument("fft: no samples");
  Transform transform(n);
  ComplexMatrix result(x.rows(), n / 2 + 1);
  Line line(static_cast<std::size_t>(n));
  for (Index i = 0; i < x.rows(); ++i) {
    for (Index k = 0; k < n; ++k) line[static_cast<std::size_t>(k)] = x(i, k);
    const Line spectrum = transform.forward(line);
    for (Index k = 0; k < result.cols(); ++k) result(i, k) = spectrum[static_cast<std::size_t>(k)];
  }
  return result;
}

Matrix inverse_fft(const ComplexMatrix& spectrum, Index samples) {
  if (samples < 1 || spectrum.cols() != samples / 2 + 1)
    throw std::invalid_argument("inverse_fft: the spectrum must have floor(N / 2) + 1 columns");
  Transform transform(samples);
  Matrix result(spectrum.rows(), samples);
  Line line(static_cast<std::size_t>(samples));
  for (Index i = 0; i < spectrum.rows(); ++i) {
    // The forward transform of the conjugate spectrum is N times the (real) signal.
    for (Index k = 0; k < spectrum.cols(); ++k) {
      const bool own_mirror = k == 0 || 2 * k == samples;
      const Complex value = own_mirror ? Complex(spectrum(i, k).real()) : spectrum(i, k);
      line[static_cast<std::size_t>(k)] = std::conj(value);
      if (!own_mirror) line[static_cast<std::size_t>(samples - k)] = value;
    }
    const Line signal = transform.forward(line);
    for (Index k = 0; k < samples; ++k)
      result(i, k) = signal[static_cast<std::size_t>(k)].real() / static_cast<double>(samples);
  }
  return result;
}

Vector fft_frequencies_hz(Index samples, double sample_time_s) {
  if (samples < 1) throw std::invalid_argument("fft_frequencies_hz: no samples");
  const Index lines = samples / 2 + 1;
  Vector result(lines);
  for (Index k = 0; k < lines; ++k) result(k) = static_cast<double>(k) / (static_cast<double>(samples) * sample_time_s);
  return result;
}

Vector hann_window(Index samples) {
  Vector result(samples);
  for (Index k = 0; k < samples; ++k)
    result(k) = 0.5 * (1 - std::cos(2 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(samples)));
  return result;
}

ComplexMatrix hann_spectrum(ConstMatrixRef x) {
  const Index n = x.cols();
  if (n == 0) throw std::invalid_argument("hann_spectrum: no samples");
  const Vector mean = x.rowwise().mean();
  const Matrix windowed = (x.colwise() - mean) * hann_window(n).asDiagonal();
  ComplexMatrix result = fft(windowed) * (4.0 / static_cast<double>(n));
  if (n % 2 == 0) result.col(n / 2) *= 0.5;
  return result;
}

}  // namespace wheelhop
