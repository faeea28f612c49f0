/// \file
/// Runs the program as a user does and keeps what it says. WHEELHOP_PROGRAM is its path.
#pragma once

#include <sys/wait.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "core/base/files.hpp"
#include "tests/support/folder.hpp"

namespace wheelhop::test {

struct Said {
  int status = -1;  ///< exit status; 128 + signal where a signal ended it
  std::string out, err;
  /// Lines of stderr.
  std::size_t lines() const { return static_cast<std::size_t>(std::count(err.begin(), err.end(), '\n')); }
};

/// @param arguments as typed in a shell   @param environment e.g. "PATH=/nowhere"
inline Said run_program(const std::string& arguments, const std::string& environment = "") {
  const Folder folder;
  const std::string out = folder / "out", err = folder / "err";
  const std::string command = "unset WHEELHOP_HOME; exec env " + environment + " '" WHEELHOP_PROGRAM "' " + arguments +
                              " >'" + out + "' 2>'" + err + "' </dev/null";
  const int state = std::system(command.c_str());
  Said said;
  said.status = WIFEXITED(state) ? WEXITSTATUS(state) : 128 + WTERMSIG(state);
  said.out = read_file(out);
  said.err = read_file(err);
  return said;
}

}  // namespace wheelhop::test
