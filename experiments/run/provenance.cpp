#include "experiments/run/provenance.hpp"

#include <fmt/format.h>

#include "build_facts.hpp"

namespace wheelhop {

Json provenance() {
  return {{"program", "wheelhop"},
          {"version", WHEELHOP_BUILD_VERSION},
          {"commit", WHEELHOP_BUILD_COMMIT},
          {"compiler", WHEELHOP_BUILD_COMPILER},
          {"flags", WHEELHOP_BUILD_FLAGS},
          {"eigen", fmt::format("{}.{}.{}", EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION)}};
}

}  // namespace wheelhop
