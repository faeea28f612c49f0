#include "core/base/random.hpp"

#include <Random123/philox.h>

#include <catch2/catch.hpp>
#include <set>
#include <stdexcept>

using namespace wheelhop;

// Known answers: file kat_vectors of Random123 (Salmon, Moraes, Dror & Shaw), rows "philox4x64 10".
TEST_CASE("the generator reproduces the published known answer of Philox 4x64-10 for zero key and counter") {
  Random random(0, static_cast<Stream>(0));
  CHECK(random.bits() == 0x16554d9eca36314cu);
  CHECK(random.bits() == 0xdb20fe9d672d0fdcu);
  CHECK(random.bits() == 0xd7e772cee186176bu);
  CHECK(random.bits() == 0x7e68b68aec7ba23bu);
}

TEST_CASE("the underlying function reproduces the published known answer for the digits of pi") {
  const philox4x64_ctr_t counter = {
      {0x243f6a8885a308d3u, 0x13198a2e03707344u, 0xa4093822299f31d0u, 0x082efa98ec4e6c89u}};
  const philox4x64_key_t key = {{0x452821e638d01377u, 0xbe5466cf34e90c6cu}};
  const philox4x64_ctr_t words = philox4x64_R(10, counter, key);
  CHECK(words.v[0] == 0xa528f45403e61d95u);
  CHECK(words.v[1] == 0x38c72dbd566e9788u);
  CHECK(words.v[2] == 0xa5a1610e72fd18b5u);
  CHECK(words.v[3] == 0x57bd43b5e52b7fe6u);
}

TEST_CASE("key is (seed, stream) and counter is (cell, realisation, block, 0)") {
  Random random(11, Stream::noise, 22, 33);
  for (int i = 0; i < 4; ++i) random.bits();
  const philox4x64_ctr_t words = philox4x64_R(10, {{22, 33, 1, 0}}, {{11, 2}});
  for (int i = 0; i < 4; ++i) CHECK(random.bits() == words.v[i]);
}

TEST_CASE("a change of seed, stream, cell or realisation alone gives other numbers, and equal keys the same") {
  std::set<std::uint64_t> seen;
  for (std::uint64_t seed : {1u, 2u})
    for (Stream stream : {Stream::road, Stream::noise, Stream::parameters, Stream::initial_guess, Stream::bootstrap})
      for (std::uint64_t cell : {0u, 1u})
        for (std::uint64_t realisation : {0u, 1u}) {
          Random a(seed, stream, cell, realisation), b(seed, stream, cell, realisation);
          for (int i = 0; i < 50; ++i) {
            const std::uint64_t word = a.bits();
            CHECK(word == b.bits());
            seen.insert(word);
          }
        }
  CHECK(seen.size() == 2 * 5 * 2 * 2 * 50);
}

TEST_CASE("neighbouring streams, cells and realisations are uncorrelated") {
  const Index n = 20000;
  const Matrix base = Random(5, Stream::road, 7, 9).normal(1, n);
  const Matrix others[] = {Random(6, Stream::road, 7, 9).normal(1, n), Random(5, Stream::noise, 7, 9).normal(1, n),
                           Random(5, Stream::road, 8, 9).normal(1, n), Random(5, Stream::road, 7, 10).normal(1, n)};
  // Standard deviation of the mean product is 1 / sqrt(n); the limit is five of them.
  for (const Matrix& other : others) CHECK(std::abs((base.array() * other.array()).mean()) < 5 / std::sqrt(double(n)));
}

TEST_CASE("uniform numbers lie strictly inside (0, 1) with the moments of the uniform law") {
  Random random(1, Stream::bootstrap);
  const int n = 200000;
  double sum = 0, squares = 0, lowest = 1, highest = 0;
  for (int i = 0; i < n; ++i) {
    const double u = random.uniform();
    sum += u;
    squares += (u - 0.5) * (u - 0.5);
    lowest = std::min(lowest, u);
    highest = std::max(highest, u);
  }
  CHECK(lowest > 0);
  CHECK(highest < 1);
  CHECK(lowest < 1e-4);
  CHECK(highest > 1 - 1e-4);
  CHECK(std::abs(sum / n - 0.5) < 5 * std::sqrt(1.0 / 12 / n));
  CHECK(std::abs(squares / n - 1.0 / 12) < 5 * std::sqrt(1.0 / 180 / n));
  // The two ends of the map from 52 bits.
  CHECK(0.5 * 0x1p-52 > 0);
  CHECK((0x1p52 - 1 + 0.5) * 0x1p-52 < 1);
}

TEST_CASE("normal numbers have mean 0, variance 1, skewness 0, kurtosis 3 and the right tail share") {
  const Index n = 400000;
  const Matrix z = Random(3, Stream::noise).normal(1, n);
  const double root = std::sqrt(double(n));
  CHECK(std::abs(z.mean()) < 5 / root);
  CHECK(std::abs(z.array().square().mean() - 1) < 5 * std::sqrt(2.0) / root);
  CHECK(std::abs(z.array().cube().mean()) < 5 * std::sqrt(15.0) / root);
  CHECK(std::abs(z.array().pow(4).mean() - 3) < 5 * std::sqrt(96.0) / root);
  const double tail = 0.0026997960632601866;  // share beyond three standard deviations
  CHECK(std::abs((z.array().abs() > 3).cast<double>().mean() - tail) < 5 * std::sqrt(tail) / root);
  // Both of a Box-Muller pair share a radius, yet they are independent.
  double product = 0, squares = 0;
  for (Index i = 0; i + 1 < n; i += 2) {
    product += z(i) * z(i + 1);
    squares += (z(i) * z(i) - 1) * (z(i + 1) * z(i + 1) - 1);
  }
  CHECK(std::abs(product / (0.5 * double(n))) < 5 / std::sqrt(0.5 * double(n)));
  CHECK(std::abs(squares / (0.5 * double(n))) < 5 * 2 / std::sqrt(0.5 * double(n)));
}

TEST_CASE("a normal matrix is filled column by column from the same stream") {
  Random a(4, Stream::road), b(4, Stream::road);
  const Matrix M = a.normal(3, 5);
  for (Index j = 0; j < 5; ++j)
    for (Index i = 0; i < 3; ++i) CHECK(M(i, j) == b.normal());
  CHECK(a.normal(0, 5).size() == 0);
}

TEST_CASE("whole numbers below n are all as frequent") {
  Random random(8, Stream::bootstrap);
  const int n = 7, draws = 70000;
  int count[7] = {};
  for (int i = 0; i < draws; ++i) {
    const Index k = random.integer(n);
    REQUIRE(k >= 0);
    REQUIRE(k < n);
    ++count[k];
  }
  for (int k = 0; k < n; ++k) CHECK(std::abs(count[k] - draws / n) < 5 * std::sqrt(double(draws) / n));
  CHECK(random.integer(1) == 0);
  const Index large = std::numeric_limits<Index>::max();
  for (int i = 0; i < 100; ++i) CHECK(random.integer(large) >= 0);
  CHECK_THROWS_AS(random.integer(0), std::invalid_argument);
  CHECK_THROWS_AS(random.integer(-3), std::invalid_argument);
}
