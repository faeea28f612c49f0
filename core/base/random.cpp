#include "core/base/random.hpp"

#include <Random123/philox.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

namespace wheelhop {

Random::Random(std::uint64_t seed, Stream stream, std::uint64_t cell, std::uint64_t realisation)
    : key_{seed, static_cast<std::uint64_t>(stream)}, cell_(cell), realisation_(realisation), block_{} {}

std::uint64_t Random::bits() {
  if (used_ == 4) {
    const philox4x64_key_t key = {{key_[0], key_[1]}};
    const philox4x64_ctr_t counter = {{cell_, realisation_, index_++, 0}};
    const philox4x64_ctr_t words = philox4x64_R(10, counter, key);
    for (int i = 0; i < 4; ++i) block_[i] = words.v[i];
    used_ = 0;
  }
  return block_[used_++];
}

double Random::uniform() {
  // Adding one half to 53 bits would round up to 1 at the top; 52 bits and a half fit a double exactly.
  return (static_cast<double>(bits() >> 12) + 0.5) * 0x1p-52;
}

double Random::normal() {
  if (has_spare_) {
    has_spare_ = false;
    return spare_;
  }
  const double radius = std::sqrt(-2 * std::log(uniform()));
  const double angle = 2 * std::numbers::pi * uniform();
  spare_ = radius * std::sin(angle);
  has_spare_ = true;
  return radius * std::cos(angle);
}

Index Random::integer(Index n) {
  if (n < 1) throw std::invalid_argument("Random::integer: n must be at least 1");
  const auto count = static_cast<std::uint64_t>(n);
  const std::uint64_t excess = (std::numeric_limits<std::uint64_t>::max() % count + 1) % count;
  const std::uint64_t last = std::numeric_limits<std::uint64_t>::max() - excess;
  std::uint64_t draw = bits();
  // A draw above `last` (probability below 1/2) would favour small results; 128 in a row do not happen.
  for (int attempt = 0; draw > last && attempt < 128; ++attempt) draw = bits();
  return static_cast<Index>(draw % count);
}

Matrix Random::normal(Index rows, Index columns) {
  Matrix result(rows, columns);
  for (Index j = 0; j < columns; ++j)
    for (Index i = 0; i < rows; ++i) result(i, j) = normal();
  return result;
}

}  // namespace wheelhop
