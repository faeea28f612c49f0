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
/// optionally `seed` (1), `order` (0: from the singular values), `record` (file name or number of the estimation
/// record; the first), `initial_state_samples` (100), `excitation_tolerance` (1e-12), `subspace`, `inversion`,
/// `nonlinearity`, `solver` (`{"name": NAME, OPTION: value}`), `pipeline`.
///
/// Checked before anything is computed (UserError): an input that is constant or not persistently exciting of order 2s
/// (Sec. 2.7, assumption 1), a constant output, too few samples for s, as many nonlinearities as outputs where eq. (17)
/// is to find their direction (assumption 2). Writes a `wheelhop.model/1` file with the scores on every record of the
/// set, and prints them.
/// @return 0; 1 if the identification failed, the model is unstable at rest, or its free run on a record diverges: the
/// file carries status and message.
int run_identify(const IdentifyRequest& request);

}  // namespace wheelhop
