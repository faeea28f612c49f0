/// \file
/// Discrete Fourier transforms of real signals, row by row.
#pragma once

#include "core/base/linalg.hpp"

namespace wheelhop {

/// One-sided spectrum X_k = sum_n x_n exp(-2 pi i k n / N), k = 0 ... floor(N / 2), not scaled: Parseval reads
/// sum x^2 = (|X_0|^2 + 2 sum |X_k|^2 + |X_N/2|^2 for even N) / N.
/// @param x c x N, any N >= 1   @return c x (floor(N / 2) + 1). Cost O(N log N), for prime N too.
/// Throws std::invalid_argument if N = 0.
ComplexMatrix fft(ConstMatrixRef x);

/// The real signal (c x N) of a one-sided spectrum: inverse of `fft`. Imaginary parts of X_0 and, for even N, of X_N/2
/// are ignored. Throws std::invalid_argument if the spectrum has not floor(N / 2) + 1 columns.
Matrix inverse_fft(const ComplexMatrix& spectrum, Index samples);

/// Frequencies of the columns of `fft` in Hz: k / (N sample_time_s).
Vector fft_frequencies_hz(Index samples, double sample_time_s);

/// Periodic Hann window w_n = (1 - cos(2 pi n / N)) / 2; its mean is 1/2, its mean square 3/8 (N >= 3).
Vector hann_window(Index samples);

/// `fft` of the mean-free rows under a Hann window, scaled to amplitudes: a sine of amplitude a on a line k reads |X_k|
/// = a there (and a/2 on both neighbours).
ComplexMatrix hann_spectrum(ConstMatrixRef x);

}  // namespace wheelhop
