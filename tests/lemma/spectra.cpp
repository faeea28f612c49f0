#include "core/data/spectra.hpp"

#include <catch2/catch.hpp>
#include <complex>
#include <numbers>
#include <stdexcept>

#include "core/base/random.hpp"

using namespace wheelhop;

namespace {

ComplexMatrix by_definition(const Matrix& x) {
  const Index n = x.cols();
  ComplexMatrix result = ComplexMatrix::Zero(x.rows(), n / 2 + 1);
  for (Index k = 0; k <= n / 2; ++k)
    for (Index j = 0; j < n; ++j)
      result.col(k) += x.col(j) * std::polar(1.0, -2 * std::numbers::pi * double(k * j % n) / double(n));
  return result;
}

}  // namespace

TEST_CASE("the transform is its definition for every length, prime ones too") {
  for (Index n : {1, 2, 3, 4, 5, 7, 8, 30, 97, 101, 128, 211, 500, 1009}) {
    CAPTURE(n);
    const Matrix x = Random(1, Stream::noise).normal(2, n);
    CHECK((fft(x) - by_definition(x)).cwiseAbs().maxCoeff() < 1e-10);
  }
}

TEST_CASE("the inverse gives the signal back and Parseval holds as documented") {
  for (Index n : {1, 2, 3, 64, 101, 499, 1000, 14951}) {
    CAPTURE(n);
    const Matrix x = Random(2, Stream::noise).normal(2, n);
    const ComplexMatrix X = fft(x);
    CHECK((inverse_fft(X, n) - x).cwiseAbs().maxCoeff() < 1e-11);
    Vector weight = Vector::Constant(X.cols(), 2);
    weight(0) = 1;
    if (n % 2 == 0) weight(n / 2) = 1;
    CHECK((X.cwiseAbs2() * weight / double(n)).isApprox(x.rowwise().squaredNorm(), 1e-11));
  }
}

TEST_CASE("a long prime length takes no quadratic time and stays accurate") {
  const Matrix x = Random(3, Stream::noise).normal(1, 131071);
  CHECK((inverse_fft(fft(x), 131071) - x).cwiseAbs().maxCoeff() < 1e-10);
}

TEST_CASE("a later sample turns the phase backwards: the sign of the exponent is minus") {
  Matrix x = Matrix::Zero(1, 8);
  x(1) = 1;
  CHECK(std::arg(fft(x)(0, 1)) == Approx(-std::numbers::pi / 4));
}

TEST_CASE("a sine on a line reads its amplitude in the Hann spectrum, a mean reads nothing") {
  for (Index n : {256, 255}) {
    Matrix x(1, n);
    for (Index k = 0; k < n; ++k) x(k) = 40 + 3 * std::sin(2 * std::numbers::pi * 20 * double(k) / double(n) + 0.7);
    const ComplexMatrix X = hann_spectrum(x);
    CHECK(std::abs(X(0, 20)) == Approx(3));
    CHECK(std::abs(X(0, 19)) == Approx(1.5));
    CHECK(std::abs(X(0, 21)) == Approx(1.5));
    CHECK(std::abs(X(0, 25)) < 1e-12);
    CHECK(std::abs(X(0, 0)) < 1e-12);
  }
  const Vector window = hann_window(100);
  CHECK(window.mean() == Approx(0.5));
  CHECK(window.squaredNorm() / 100 == Approx(0.375));
  CHECK(fft_frequencies_hz(200, 0.005)(50) == Approx(50));
}

TEST_CASE("empty signals and spectra of the wrong width are refused") {
  CHECK_THROWS_AS(fft(Matrix(1, 0)), std::invalid_argument);
  CHECK_THROWS_AS(hann_spectrum(Matrix(1, 0)), std::invalid_argument);
  CHECK_THROWS_AS(inverse_fft(ComplexMatrix::Zero(1, 4), 8), std::invalid_argument);
  CHECK_THROWS_AS(inverse_fft(ComplexMatrix::Zero(1, 1), 0), std::invalid_argument);
}
