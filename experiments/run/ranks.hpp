/// \file
/// The MPI job that a program was started in by mpirun or srun, as far as a loop over rows needs it: rank 0 hands out
/// numbers and collects what the others make of them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace wheelhop {

/// What a rank sends when it asks for work.
struct Delivery {
  int from = 0;
  bool has_result = false;
  std::string result;  ///< of the number it was given last
};

/// One a program. Without a launcher in the environment it is alone: rank 0 of 1. All calls from the main thread.
class Ranks {
 public:
  /// Starts MPI if a launcher started the program. UserError if one did and this build has no MPI.
  Ranks();
  ~Ranks();
  Ranks(const Ranks&) = delete;
  Ranks& operator=(const Ranks&) = delete;

  int rank() const { return rank_; }
  int size() const { return size_; }
  bool first() const { return rank_ == 0; }

  /// Rank 0 tells the others whether there is work at all; they hear it.
  bool agree(bool go_on);

  std::optional<Delivery> poll();            ///< rank 0: what waits from another rank, if anything
  void assign(int rank, std::int64_t work);  ///< rank 0: work < 0 ends the rank's loop
  /// Other ranks: delivers a result, if any, and waits for the next number; negative: none is left.
  std::int64_t ask(const std::optional<std::string>& result);

  /// Ends the processes of all ranks: a rank that cannot go on must not leave the others waiting for it.
  [[noreturn]] void abort(int exit_status);

  std::vector<int> waiting;  ///< rank 0: ranks that asked and have no answer yet

 private:
  int rank_ = 0, size_ = 1;
  bool started_ = false;
};

}  // namespace wheelhop
