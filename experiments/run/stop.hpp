/// \file
/// Ctrl-C and SIGTERM, caught while work can be stopped cleanly.
#pragma once

#include <string>

namespace wheelhop {

/// From now on SIGINT and SIGTERM end the program, with status 128 + signal, after one line on stderr that says how to
/// go on, except while a StopSignals lives. @param go_on at most 400 bytes
void say_when_stopped(const std::string& go_on);

/// While it lives, SIGINT and SIGTERM are noted instead of ending the program. A second one of a kind ends it at once.
class StopSignals {
 public:
  StopSignals();
  ~StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

  static int received();  ///< number of the first signal noted; 0: none
};

}  // namespace wheelhop
