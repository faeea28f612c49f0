/// \file
/// `wheelhop diagnose --plant P.json --records R.json --out D.json [--report D.html]`: why a plant and its records
/// disagree.
#pragma once

#include <filesystem>

#include "core/gap/diagnose.hpp"
#include "core/gap/study/examine.hpp"
#include "experiments/diagnose/view.hpp"

namespace wheelhop {

/// The catalogue with some families taken out, by effect id.
CandidateList catalogue_without(std::vector<std::string> left_out);

/// diagnose() with the solver, options and random numbers of the command: same plant and records, same answer.
Diagnosis diagnose_records(const Plant& plant, const RecordSet& set, const CandidateList& candidates,
                           const std::function<void(const std::string&)>& step = {});

/// "D.json" -> "D.plant.json", where the plant with the answer is written.
std::filesystem::path corrected_beside(std::filesystem::path diagnosis);

/// Writes the plant with the answer beside `out`, with the ending `.plant.json`, and then `out` (schema
/// `wheelhop.diagnosis/1`). @param examination null: without where in bands, ranges and time the gap lies
/// @param view what of it is shown   @param more members added to the latter   @return the former
std::filesystem::path write_diagnosis(const Plant& plant, const Diagnosis& diagnosis, const Examination* examination,
                                      const View& view, const std::filesystem::path& out,
                                      const Json& more = Json::object());

struct DiagnoseRequest {
  std::filesystem::path plant, records, out;
  std::filesystem::path report = {};  ///< page with pictures; empty: none
  bool quiet = false;
  Index placebo = 0;  ///< runs of the placebo
};

/// Prints the answer in one sentence and a table, and writes two files: `out` (schema `wheelhop.diagnosis/1`) and,
/// beside it with the ending `.plant.json`, the plant with the answer, which `wheelhop simulate` runs.
/// With `report`, also the data of its figures beside `out` (ending `.figures.json`) and the page; where Node.js is
/// missing it says so, and the diagnosis stands. With `placebo`, the diagnosis is written first without it.
/// @return 0; 1 if the plant cannot follow the records (the file says so). UserError for every mistake in the files,
/// before anything is computed.
int run_diagnose(const DiagnoseRequest& request);

}  // namespace wheelhop
