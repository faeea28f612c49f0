#include "experiments/run/stop.hpp"

#include <unistd.h>

#include <csignal>
#include <string>

namespace wheelhop {
namespace {

volatile std::sig_atomic_t noted = 0;
struct sigaction before_interrupt, before_terminate;

void note(int signal) {
  if (noted == 0) noted = signal;
}

// A handler may use neither memory of its own nor streams.
char last_words[512];
std::size_t last_words_size = 0;

void speak_and_end(int signal) {
  static_cast<void>(!::write(STDERR_FILENO, last_words, last_words_size));
  ::_exit(128 + signal);
}

}  // namespace

void say_when_stopped(const std::string& go_on) {
  const std::string line = "wheelhop: stopped; " + go_on + "\n";
  last_words_size = line.copy(last_words, sizeof last_words);
  struct sigaction action = {};
  action.sa_handler = speak_and_end;
  for (const int signal : {SIGINT, SIGTERM}) {
    struct sigaction before = {};
    ::sigaction(signal, nullptr, &before);
    if (before.sa_handler != SIG_IGN) ::sigaction(signal, &action, nullptr);  // nohup, and jobs in the background
  }
}

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
