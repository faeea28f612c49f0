/// \file
/// How far a long command is, on stderr.
#pragma once

#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <mutex>
#include <string>

namespace wheelhop {

/// A bar on a terminal, a line a minute elsewhere, with the time left; nothing if quiet. Safe to call from several
/// threads.
class Progress {
 public:
  Progress(std::string what, long total, bool quiet)
      : what_(std::move(what)), total_(total), quiet_(quiet), terminal_(::isatty(STDERR_FILENO) == 1) {
    show(false);
  }
  ~Progress() {
    if (!quiet_ && terminal_) std::fputc('\n', stderr);
  }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// One more part is done.
  void advance() {
    const std::lock_guard lock(mutex_);
    ++done_;
    show(done_ == total_);
  }

 private:
  void show(bool last) {
    if (quiet_) return;
    const auto now = std::chrono::steady_clock::now();
    if (terminal_) {
      const int width = 30, filled = static_cast<int>(total_ > 0 ? width * done_ / total_ : width);
      std::fprintf(stderr, "\r%s [%s%s] %ld of %ld%s\033[K", what_.c_str(), std::string(filled, '#').c_str(),
                   std::string(width - filled, '.').c_str(), done_, total_, left(now).c_str());
      std::fflush(stderr);
    } else if (last || now - shown_ >= std::chrono::minutes(1)) {
      std::fprintf(stderr, "%s: %ld of %ld done%s\n", what_.c_str(), done_, total_, left(now).c_str());
      shown_ = now;
    }
  }

  /// ", about 3 min left" once a part is done, from the mean time of those.
  std::string left(std::chrono::steady_clock::time_point now) const {
    if (done_ == 0 || done_ == total_) return "";
    const double s = std::chrono::duration<double>(now - start_).count() * static_cast<double>(total_ - done_) /
                     static_cast<double>(done_);
    char text[64];
    if (s < 90)
      std::snprintf(text, sizeof text, ", about %.0f s left", s);
    else if (s < 5400)
      std::snprintf(text, sizeof text, ", about %.0f min left", s / 60);
    else
      std::snprintf(text, sizeof text, ", about %.1f h left", s / 3600);
    return text;
  }

  std::string what_;
  long total_, done_ = 0;
  bool quiet_, terminal_;
  std::mutex mutex_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now(), shown_ = start_;
};

}  // namespace wheelhop
