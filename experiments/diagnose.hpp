/// \file
/// `wheelhop diagnose --plant P.json --records R.json --out D.json`: why a plant and its records disagree.
#pragma once

#include <filesystem>

namespace wheelhop {

struct DiagnoseRequest {
  std::filesystem::path plant, records, out;
  bool quiet = false;
};

/// Prints the answer in one sentence and a table, and writes two files: `out` (schema `wheelhop.diagnosis/1`) and,
/// beside it with the ending `.plant.json`, the plant with the answer, which `wheelhop simulate` runs.
/// @return 0; 1 if the plant cannot follow the records (the file says so). UserError for every mistake in the files,
/// before anything is computed.
int run_diagnose(const DiagnoseRequest& request);

}  // namespace wheelhop
