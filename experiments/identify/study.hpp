/// \file
/// The parts of `wheelhop identify`: config and checks, scores, print.
#pragma once

#include <string>
#include <vector>

#include "core/data/records.hpp"
#include "core/identify/delivery.hpp"
#include "core/model/model_file.hpp"
#include "experiments/experiment/study.hpp"

namespace wheelhop {

/// Members of the config beside channels, record, pieces and pipeline.
struct IdentifyOptions {
  Index seed = 1;
  Index initial_state_samples = 0;
  Index starts = 0;
  bool cut_off_outputs = true;
  double excitation_tolerance = 1e-12;
  template <class V>
  void fields(V&& visit) {
    visit("seed", seed, Range{0}, "-", "of the initial guesses");
    visit(
        "initial_state_samples", initial_state_samples, Range{0}, "-",
        "of a record that is not fitted, from which the free run's initial state is estimated; 0: three periods of the "
        "slowest mode, at least 100 and at most a quarter of the record");
    visit("starts", starts, Range{0, 1000}, "-",
          "runs of the pipeline from different initial guesses, the best of which is compared; 0: up to 16 on short "
          "records of low order, 1 from about 2200 fitted samples on");
    visit("cut_off_outputs", cut_off_outputs,
          "an output that stands at its highest or lowest value again and again was cut off there: the model gets that "
          "limit, and is not fitted to what lies beyond");
    visit("excitation_tolerance", excitation_tolerance, Range{0, 1}, "-",
          "with $.subspace: singular value of the drive's block-Hankel matrix, relative to the largest, below which it "
          "counts as none");
  }
};

struct IdentifyConfig {
  std::vector<Channel> inputs, outputs;
  IdentifyOptions options;
  std::vector<Index> trained;  ///< numbers of the records for estimation that are used, at least one
  PieceSet pieces;
  DeliveryOptions delivery;
  RecordSet set;
  Index excitation_found = 0, excitation_needed = 0;  ///< orders; found counts up to what is needed
  Json effective;

  /// The records that are used.
  std::vector<Signal> training() const;
  bool trains_on(std::size_t record) const;
};

/// Reads config and records and makes all checks that need no computation beyond the drive's excitation.
IdentifyConfig read_identify_config(const std::filesystem::path& config, const std::filesystem::path& records);

/// Scores of a model on one record.
struct RecordScore {
  std::string file, role;
  Index first = 0, samples = 0;  ///< part of the file that was scored: [first, first + samples)
  Status status = Status::failed;
  std::string message;
  Vector vaf, rmse, nrmse;  ///< p of the model; rmse in the units of the outputs
  Vector linear_vaf;        ///< p of the linear model of step 1
  std::vector<Excess> beyond;
  Index samples_beyond = 0;  ///< with any channel outside the envelope
};

/// Initial state of a model on a record in physical units, from its first samples.
/// @param samples 0: initial_state_span()
Vector initial_state(const ModelFile& model, const Signal& record, Index samples);

void print_identification(const IdentifyConfig& config, const Delivery& result, const ModelFile& model,
                          const std::vector<RecordScore>& scores);

}  // namespace wheelhop
