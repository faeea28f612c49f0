/// \file
/// `wheelhop diagnose --plant P.json --records R.json --out D.json [--report D.html]`: why a plant and its records
/// disagree.
#pragma once

#include <filesystem>

namespace wheelhop {

struct DiagnoseRequest {
  std::filesystem::path plant, records, out;
  std::filesystem::path report = {};  ///< page with pictures; empty: none
  bool quiet = false;
};

/// Prints the answer in one sentence and a table, and writes two files: `out` (schema `wheelhop.diagnosis/1`) and,
/// beside it with the ending `.plant.json`, the plant with the answer, which `wheelhop simulate` runs.
/// With `report`, also the data of its figures beside `out` (ending `.figures.json`) and the page; where Node.js is
/// missing it says so, and the diagnosis stands.
/// @return 0; 1 if the plant cannot follow the records (the file says so). UserError for every mistake in the files,
/// before anything is computed.
int run_diagnose(const DiagnoseRequest& request);

}  // namespace wheelhop
