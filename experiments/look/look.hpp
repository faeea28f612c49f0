/// \file
/// `wheelhop look FILE`: what a logger's file holds, and the `records.json` that reads it.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace wheelhop {

struct LookRequest {
  std::filesystem::path file;  ///< any that records may name
  std::filesystem::path out;   ///< `records.json` to write; empty: none
  double rate_hz = 0;          ///< 0: as the file tells it
  std::string layout;          ///< members of "format" as JSON; empty: all of it is to be found
};

/// Prints layout, time, a line a column, and the `records.json`.
/// @return 0; 1 if no rate was found: then no `records.json` is printed or written and stderr says why
int run_look(const LookRequest& request);

}  // namespace wheelhop
