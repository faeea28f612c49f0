#include "experiments/run/standard_output.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <string>
#include <system_error>

#include "core/base/status.hpp"

namespace wheelhop {
namespace {

bool output_was_closed = false;

}  // namespace

void keep_standard_streams() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(stream, F_GETFD) >= 0 || errno != EBADF) continue;
    if (stream == STDOUT_FILENO) output_was_closed = true;
    static_cast<void>(::open("/dev/null", stream == STDIN_FILENO ? O_RDONLY : O_WRONLY));  // takes the lowest number
  }
}

void require_standard_output() {
  if (output_was_closed) throw UserError("stdout: expected a place for the result, found it closed");
}

void finish_standard_output() {
  errno = 0;
  const bool failed = std::ferror(stdout) != 0;
  if (std::fflush(stdout) != 0 || failed)
    throw MachineError("stdout: cannot write: " + std::generic_category().message(errno != 0 ? errno : EIO));
}

}  // namespace wheelhop
