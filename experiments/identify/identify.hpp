/// \file
/// `wheelhop identify CONFIG --records R.json --out MODEL.json`: the pipeline on any record, simulated or measured.
#pragma once

#include <filesystem>

namespace wheelhop {

struct IdentifyRequest {
  std::filesystem::path config, records;
  std::filesystem::path out;  ///< the model file
  bool quiet = false;
};

/// Config: `{"inputs": [{"name", "unit"}], "outputs": [{"name", "unit"}]}` or `{"plant": FILE}` for the channels, and
/// optionally `seed` (1), `order` (0: found), `record` (file name or number of one record to fit; all for estimation),
/// `initial_state_samples` (0: from the slowest mode), `starts` (0: by the length of the record), `linear` (options of
/// search_linear()) or `subspace` (a piece in its place, with `excitation_tolerance`), `inversion`, `nonlinearity`,
/// `solver` (`{"name": NAME, OPTION: value}`), `pipeline`. Where `pipeline` leaves out `direct_term` both forms are
/// tried, where it leaves out `direction` and there are too few outputs for eq. (17) it is "input". What is delivered:
/// deliver().
///
/// Checked before anything is computed (UserError): a constant input or output, an input made of the others, a drive of
/// which the outputs follow no more than one sine; with `subspace` an input that is not persistently exciting of order
/// 2s (Sec. 2.7, assumption 1) and too few samples for s; as many nonlinearities as outputs where eq. (17) is to find
/// their direction (assumption 2). Writes a `wheelhop.model/1` file with the scores on every record of the set, the
/// uncertainty of modes and responses, and what the initial state of another record is estimated with, and prints the
/// scores. An unstable pole at rest, and what the model leaves beside white noise, stand in its message.
/// @return 0; 1 if the identification failed or its free run on a record diverges: the
/// file carries status and message.
int run_identify(const IdentifyRequest& request);

}  // namespace wheelhop
