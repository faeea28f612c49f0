#include "experiments/run/jobs.hpp"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

#include "experiments/run/progress.hpp"
#include "experiments/run/stop.hpp"

namespace wheelhop {

Index threads_of(const JobOptions& options) {
  return options.jobs > 0 ? options.jobs : std::max<Index>(1, std::thread::hardware_concurrency());
}

void stop_program(int signal, const std::string& go_on) {
  std::fflush(stdout);
  std::fprintf(stderr, "\nwheelhop: stopped; %s\n", go_on.c_str());
  std::_Exit(128 + signal);
}

void run_jobs(std::size_t count, const JobOptions& options, const Job& job) {
  if (count == 0) return;
  const StopSignals signals;
  Progress progress(options.what, static_cast<long>(count), options.quiet);
  std::mutex one_at_a_time;
  std::condition_variable ended;
  std::exception_ptr failure;
  std::size_t next = 0;
  const auto take = [&](std::size_t& mine) {
    const std::lock_guard lock(one_at_a_time);
    if (next >= count || failure) return false;
    mine = next++;
    return true;
  };
  std::size_t working = std::min<std::size_t>(static_cast<std::size_t>(threads_of(options)), count);
  const auto work = [&] {
    try {
      for (std::size_t i = 0; take(i);) {
        const std::function<void()> keep = job(i);
        const std::lock_guard lock(one_at_a_time);
        if (keep) keep();
        progress.advance();
      }
    } catch (...) {
      const std::lock_guard lock(one_at_a_time);
      if (!failure) failure = std::current_exception();
    }
    const std::lock_guard lock(one_at_a_time);
    --working;
    ended.notify_all();
  };
  std::vector<std::jthread> threads;
  for (std::size_t i = working; i > 0; --i) threads.emplace_back(work);
  {
    std::unique_lock lock(one_at_a_time);
    while (working > 0) {
      ended.wait_for(lock, std::chrono::milliseconds(50));
      if (const int signal = StopSignals::received(); signal != 0) stop_program(signal, options.go_on);
      try {
        if (options.meanwhile && !failure) options.meanwhile();
      } catch (...) {
        failure = std::current_exception();
      }
    }
  }
  threads.clear();
  if (failure) std::rethrow_exception(failure);
}

}  // namespace wheelhop
