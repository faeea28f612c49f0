/// \file
/// What identify and reproduce share: the pieces a config asks for, and models on signals in physical units.
#pragma once

#include "core/identify/pipeline.hpp"
#include "variants/table.hpp"

namespace wheelhop {

/// The four pieces of a run and their effective options.
struct PieceSet {
  Made<SubspacePiece> subspace;
  Made<InversionPiece> inversion;
  Made<MapFactory> nonlinearity;
  Made<SolverPiece> solver;

  /// Valid as long as this set lives. @param options name the alternative map
  Pieces borrowed(const PipelineOptions& options) const;
  Json config() const;  ///< `{"subspace": {...}, "inversion": {...}, "nonlinearity": {...}, "solver": {...}}`
};

/// Reads the members `subspace`, `inversion`, `nonlinearity` and `solver` of a config, each optional: absent, it is the
/// one of `base`, or without a base pi_moesp, sdi, mlp and levenberg_marquardt with their defaults.
PieceSet read_pieces(const JsonCursor& config, const PieceSet* base = nullptr);

/// The optional member `pipeline` of a config over the given defaults.
PipelineOptions read_pipeline(const JsonCursor& config, PipelineOptions defaults = {});

/// `{"status", "message", "iterations", "cost", "round_costs": [...]}`; a failed round is null.
Json to_json(const Refinements& refinement);

/// A free run on a record, in physical units.
struct ScoredRun {
  Status status = Status::failed;
  std::string message;
  Matrix x;    ///< n x N
  Matrix y;    ///< p x N, in the units of the outputs
  Matrix f;    ///< q x N
  Vector vaf;  ///< p against `reference`; -infinity where the run diverged
};

/// Simulates the model on a record; its initial state is estimated from the record's first samples.
/// @param signal u and y as measured   @param reference p x N outputs to score against (of a simulation: without noise)
ScoredRun run_and_score(const NonlinearModel& model, const Scaling& scaling, const Signal& signal,
                        ConstMatrixRef reference, Index initial_state_samples);

}  // namespace wheelhop
