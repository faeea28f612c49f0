/// \file
/// Ctrl-C and SIGTERM, caught while work can be stopped cleanly.
#pragma once

namespace wheelhop {

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
