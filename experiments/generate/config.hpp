/// \file
/// The config of `wheelhop generate`.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/base/options.hpp"
#include "core/plant/plant.hpp"
#include "core/plant/road.hpp"

namespace wheelhop {

/// Members beside `plant`, `hold_hz` and `records`.
struct GenerateOptions {
  double sampling_hz = 200;
  Index seed = 1, realisation = 0, substeps = 0;
  std::optional<double> noise_snr_db;
  double settle_s = 2;
  std::string start = "equilibrium";
  template <class V>
  void fields(V&& visit) {
    visit("sampling_hz", sampling_hz, Range{1e-3, 1e7}, "Hz", "samples of a record a second");
    visit("seed", seed, Range{0}, "-", "of drives and noise");
    visit("realisation", realisation, Range{0}, "-", "which of the sets of records that belong to the seed");
    visit("noise_snr_db", noise_snr_db, Range{-100, 300}, "dB", "white noise this far below every output; null: none");
    visit("settle_s", settle_s, Range{0, 1e5}, "s", "simulated before each record begins");
    visit("start", start, Choices{{"equilibrium", "zero"}}, "state before that");
    visit("substeps", substeps, Range{0, 1000}, "-",
          "steps of the integrator a hold interval; 0: as many as the plant's stiffness needs");
  }
};

/// Members of a group of records beside `drive`.
struct GroupOptions {
  std::string role;
  double duration_s = 0;
  Index repeats = 1;
  template <class V>
  void fields(V&& visit) {
    visit("role", role, Choices{{"estimation", "validation"}}, "what the records are for");
    visit("duration_s", duration_s, Range{0, 1e6}, "s", "of each record, whole samples; required");
    visit("repeats", repeats, Range{1, 10000}, "-", "records of the same drive with other noise");
  }
};

struct DriveGroup {
  GroupOptions options;
  std::map<Index, DriveOptions> drives;  ///< by input; an input without one stays at zero
};

struct GenerateConfig {
  Plant plant;
  GenerateOptions options;
  std::vector<DriveGroup> groups;
};

/// @return with substeps chosen. UserError with file and JSON path for every mistake.
GenerateConfig read_generate_config(const JsonCursor& cursor);

/// All of it, defaults filled in.
Json effective_config(const GenerateConfig& config);

}  // namespace wheelhop
