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

/// Runs `node HOME/plots/render.mjs RESULT [--out FILE]`. @param result folder of a reproduction, or a diagnosis file
/// @param page empty: DIR/report.html, D.html
Rendered render(const std::filesystem::path& result, const std::filesystem::path& page = {});

struct ReportRequest {
  std::filesystem::path result, page;  ///< as of render()
};

/// `wheelhop report RESULT [--out FILE]`: the same, with its reason on stderr where it fails.
/// @return 0; 2 if render.mjs refuses the result; else 1
int run_report(const ReportRequest& request);

}  // namespace wheelhop
