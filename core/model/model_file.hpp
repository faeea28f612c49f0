/// \file
/// The model file `wheelhop.model/1`: an identified model together with everything needed to run it on another record
/// and to know where it came from. Signals in the file are in physical units, the matrices act on scaled ones.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "core/data/signal.hpp"
#include "core/model/nonlinear.hpp"

namespace wheelhop {

/// Smallest and largest value of every row of a matrix.
struct Extremes {
  Vector low, high;
};
Extremes extremes_of(ConstMatrixRef rows);

/// What a model met in training: a free run outside extrapolates.
struct Envelope {
  Extremes u;  ///< m, units of the inputs
  Extremes y;  ///< p, units of the outputs, as measured
  Extremes f;  ///< q, of the free run on the training record; empty for a linear model
};

struct ModelFile {
  Status status = Status::ok;  ///< of the identification; unstable, iteration_limit, ... are told, not hidden
  std::string message;
  std::vector<Channel> inputs, outputs;
  double sampling_hz = 0;
  Vector u_scale, y_scale;        ///< m and p; the model sees (u - u_offset) ./ u_scale and y ./ y_scale
  Vector u_offset = {};           ///< m, units of the inputs; empty: none
  std::vector<Index> delay = {};  ///< m, samples by which each input acts late; empty: none
  OutputLimits limits = {};       ///< p, units of the outputs; those of the model are these over y_scale
  NonlinearModel model;
  Vector x0;                    ///< n, initial state of the training record
  StateStatistics states = {};  ///< on the training records, residual_std in the model's scale; unknown in older files
  Envelope envelope;
  Json config = Json::object();      ///< effective config of the identification
  Json uncertainty = nullptr;        ///< of poles, frequency response and free runs; null: not known
  Json scores = Json::object();      ///< of estimation and validation records
  Json provenance = Json::object();  ///< program, commit, compiler
};

/// Restores a trained map from the member `map`. @param inputs n + m   @param outputs q
using RestoreMap = std::function<std::unique_ptr<StaticMap>(const JsonCursor& map, Index inputs, Index outputs)>;

/// `parse_model(to_json(model))` simulates the same bytes.
Json to_json(const ModelFile& file);
/// The file of an identification that ended without a model: status, message, config and provenance alone.
Json without_model(const ModelFile& file);
/// UserError with file and JSON path for a missing or unknown member, another schema, matrices or ranges whose sizes do
/// not fit the channels, a scale that is not positive, every mistake in the map, and a file without a model.
ModelFile parse_model(const JsonCursor& cursor, const RestoreMap& restore);
ModelFile load_model(const std::filesystem::path& file, const RestoreMap& restore);

/// The inputs as the model sees them. An input that acts late is held at its first value before the record.
/// @param u m x N, physical units
Matrix acting_inputs(const ModelFile& file, ConstMatrixRef u);
/// Samples at the start of a record that depend on inputs from before it.
Index longest_delay(const ModelFile& file);

/// Free run in physical units. @param u m x N inputs   @param x0 n; y is p x N in the units of the outputs
FreeRun free_run(const ModelFile& file, ConstMatrixRef u, ConstVectorRef x0);

/// One channel of a run that left the envelope.
struct Excess {
  std::string channel;  ///< name of an input or output, or "f_1" ...
  std::string unit;     ///< empty for f
  Index samples = 0;    ///< outside
  double distance = 0;  ///< largest, in the unit of the channel
  double share = 0;     ///< that distance over the width of the training range
};
/// Channels that leave the envelope by more than 1e-9 of its width. @param u, y, f rows as in the envelope
std::vector<Excess> beyond_envelope(const ModelFile& file, ConstMatrixRef u, ConstMatrixRef y, ConstMatrixRef f);

}  // namespace wheelhop
