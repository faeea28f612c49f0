#include "experiments/run/home.hpp"

#include <cstdlib>

#include "build_facts.hpp"
#include "core/base/status.hpp"

namespace wheelhop {

std::filesystem::path home() {
  const char* given = std::getenv("WHEELHOP_HOME");
  const std::filesystem::path folder = given && *given ? given : WHEELHOP_BUILD_HOME;
  std::error_code ignored;
  if (!std::filesystem::is_directory(folder / "experiments" / "configs", ignored))
    throw UserError(folder.string() +
                    ": expected the repository with the folder experiments/configs; set WHEELHOP_HOME to it");
  return folder;
}

}  // namespace wheelhop
