/// \file
/// Counter-based random numbers (Philox 4x64-10; Salmon, Moraes, Dror & Shaw 2011, "Parallel random numbers: as easy as
/// 1, 2, 3", through Random123). A number is a pure function of (master seed, stream, cell, realisation, index), so
/// that streams are independent, adding noise never changes the road, and threads cannot change results. Uniform and
/// normal deviates are our own, because those of the standard library differ between implementations.
#pragma once

#include <cstdint>

#include "core/base/linalg.hpp"

namespace wheelhop {

/// Independent purposes of random numbers. The values are part of the result format: never renumber.
enum class Stream : std::uint64_t { road = 1, noise = 2, parameters = 3, initial_guess = 4, bootstrap = 5 };

/// Key = (seed, stream), counter = (cell, realisation, block index, 0); a block holds four 64-bit words.
class Random {
 public:
  /// @param seed master seed   @param cell grid cell   @param realisation Monte-Carlo repetition inside the cell
  Random(std::uint64_t seed, Stream stream, std::uint64_t cell = 0, std::uint64_t realisation = 0);

  std::uint64_t bits();                      ///< next 64 random bits
  double uniform();                          ///< odd multiples of 2^-53 in (0, 1): never 0 or 1, symmetric about 1/2
  double normal();                           ///< standard normal (Box-Muller)
  Index integer(Index n);                    ///< in [0, n) without bias; std::invalid_argument if n < 1
  Matrix normal(Index rows, Index columns);  ///< filled column by column

 private:
  std::uint64_t key_[2];
  std::uint64_t cell_, realisation_, index_ = 0;
  std::uint64_t block_[4];
  int used_ = 4;
  double spare_ = 0;
  bool has_spare_ = false;
};

}  // namespace wheelhop
