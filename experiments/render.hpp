/// \file
/// Figures and report page, drawn by plots/render.mjs.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace wheelhop {

struct Rendered {
  int exit_status = 0;  ///< of render.mjs; 127 where it could not be started
  std::string message;  ///< empty where the status is 0; render.mjs itself has written its reason to stderr
};

/// Runs `node HOME/plots/render.mjs DIR [--out FILE]`. @param page empty: DIR/report.html
Rendered render(const std::filesystem::path& folder, const std::filesystem::path& page = {});

}  // namespace wheelhop
