/// \file
/// What the fuzz targets share. A reader answers any bytes with what it has read or with a UserError; whatever else
/// happens (another exception, a fault that a sanitizer sees, a property that does not hold) is a finding.
#pragma once

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "core/base/status.hpp"
#include "tests/support/folder.hpp"

namespace wheelhop::fuzz {

/// Ends the process, as a finding, where a property of what was read does not hold.
inline void require(bool holds, const char* property) {
  if (holds) return;
  std::fprintf(stderr, "a property does not hold: %s\n", property);
  std::abort();
}

inline std::string text_of(const std::uint8_t* data, std::size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}

/// A folder for readers of files, one a process.
inline const test::Folder& folder() {
  static const test::Folder own;
  return own;
}

/// Writes a file in that folder, as it is: nothing is lost with it.
inline std::filesystem::path put(const char* name, const std::string& content) {
  const std::filesystem::path file = folder() / name;
  std::ofstream(file, std::ios::binary) << content;
  return file;
}

/// Calls read(). @return 0
template <class Read>
int answered(Read&& read) {
  try {
    read();
  } catch (const UserError& error) {
    require(error.what()[0] != '\0', "a refusal says why");
  }
  return 0;
}

}  // namespace wheelhop::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);
