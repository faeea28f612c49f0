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

Json provenance(const RecordSet& set) {
  Json out = provenance(), reading = Json::array();
  for (std::size_t i = 0; i < set.records.size(); ++i)
    if (const Record& record = set.records[i]; !record.reading.empty())
      reading.push_back({{"record", i}, {"file", record.file}, {"did", record.reading}});
  if (!reading.empty()) out["reading"] = std::move(reading);
  return out;
}

}  // namespace wheelhop
