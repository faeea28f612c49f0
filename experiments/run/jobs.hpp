/// \file
/// The loop of every long command: jobs on threads, their results one at a time, progress, and a clean stop.
#pragma once

#include <cstddef>
#include <functional>
#include <string>

#include "core/base/linalg.hpp"

namespace wheelhop {

struct JobOptions {
  Index jobs = 0;      ///< at once; 0: as many as the machine has threads
  std::string what;    ///< for the progress line: "sweep"
  std::string go_on;   ///< said when a signal stops the loop: how to go on
  bool quiet = false;  ///< no progress
  /// Called many times a second while jobs run, under the lock of the results; what it throws ends the loop.
  std::function<void()> meanwhile = {};
};

/// Computes a job and returns what is to be done with its result.
using Job = std::function<std::function<void()>(std::size_t)>;

/// Calls job(i) for every i in [0, count), taken in this order by whichever thread is free. What it returns is called
/// under a lock, so that results are written one at a time. What a job or its continuation throws ends the loop once
/// the jobs under way have ended, and is thrown here.
///
/// SIGINT or SIGTERM ends the program within a second with exit status 128 + signal, between two results: jobs under
/// way are given up, and `go_on` is said on stderr.
void run_jobs(std::size_t count, const JobOptions& options, const Job& job);

/// options.jobs, or the number of hardware threads where it is 0.
Index threads_of(const JobOptions& options);

/// Ends the program as a stop signal asks for, saying `go_on`.
[[noreturn]] void stop_program(int signal, const std::string& go_on);

}  // namespace wheelhop
