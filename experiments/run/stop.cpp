#include "experiments/run/stop.hpp"

#include <csignal>

namespace wheelhop {
namespace {

volatile std::sig_atomic_t noted = 0;
struct sigaction before_interrupt, before_terminate;

void note(int signal) {
  if (noted == 0) noted = signal;
}

}  // namespace

StopSignals::StopSignals() {
  noted = 0;
  struct sigaction action = {};
  action.sa_handler = note;
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  ::sigaction(SIGINT, &action, &before_interrupt);
  ::sigaction(SIGTERM, &action, &before_terminate);
}

StopSignals::~StopSignals() {
  ::sigaction(SIGINT, &before_interrupt, nullptr);
  ::sigaction(SIGTERM, &before_terminate, nullptr);
}

int StopSignals::received() { return noted; }

}  // namespace wheelhop
