/// \file
/// The algorithm of the paper's Sec. 2.7 on one record, and the joint refinement that follows it. Works on signals
/// scaled to unit RMS a channel and on whitened states; the scaling goes with the result.
#pragma once

#include <functional>
#include <vector>

#include "core/base/options.hpp"
#include "core/data/signal.hpp"
#include "core/identify/decomposition.hpp"
#include "core/identify/direction.hpp"
#include "core/identify/map_fit.hpp"
#include "core/identify/pieces.hpp"
#include "core/identify/ridge.hpp"
#include "core/model/nonlinear.hpp"

namespace wheelhop {

struct PipelineOptions {
  Index order = 0;
  Index linear_iterations = 0;
  Index nonlinearities = 1;
  bool direct_term = true;
  std::string direction = "trackability";
  Index passes = 3;
  Index map_starts = 3;
  Index map_iterations = 60;
  Index refine_rounds = 4;
  Index round_iterations = 8;
  Index refine_iterations = 100;
  std::string alternative_map = "ridge_polynomial";
  Index ridge_degree = 11;
  Index hardening_degree = 21;
  bool keep_trajectories = false;  ///< fills Pass::along. Set by the program alone: it costs memory
  template <class V>
  void fields(V&& visit) {
    visit("order", order, Range{0, 100}, "-", "n; 0: read from the singular values");
    visit("linear_iterations", linear_iterations, Range{0, 10000}, "-",
          "cap on a refinement of the linear model of step 1 by its own simulation error (output error); 0: none");
    visit("nonlinearities", nonlinearities, Range{0, 20}, "-",
          "q, number of auxiliary inputs f; 0: the linear model alone");
    visit("direct_term", direct_term,
          "let f act on the outputs of the same sample (Dt), as accelerations need; false: eq. (5) as printed");
    visit("direction", direction, Choices{{"trackability", "input"}},
          "first [Bt; Dt]: by eq. (17), which needs q < p, or from physics: f enters where the first inputs do");
    visit("passes", passes, Range{1, 20}, "-", "rounds of steps 3 to 5; the best by training free run is kept");
    visit("map_starts", map_starts, Range{1, 50}, "-",
          "random starts of the static map in the first pass and in every round of the refinement");
    visit("map_iterations", map_iterations, Range{1, 1000}, "-", "cap on the map's iterations a start");
    visit("refine_rounds", refine_rounds, Range{0, 50}, "-",
          "times at most the map is fitted anew from the refined linear part, against its local minima");
    visit("round_iterations", round_iterations, Range{1, 1000}, "-", "joint refinement before each of these rounds");
    visit("refine_iterations", refine_iterations, Range{0, 10000}, "-", "cap on the joint refinement; 0: none");
    visit("alternative_map", alternative_map, Choices{},
          "piece of the nonlinearity family, with the options degree, odd and hardening, that may take the map's place "
          "in "
          "the refinement where the record fits it better; none: the map stays");
    visit("ridge_degree", ridge_degree, Range{0, 30}, "-", "highest power of the alternative map; below 3: none");
    visit("hardening_degree", hardening_degree, Range{0, 60}, "-",
          "the same with odd powers of one sign alone, which hold farther beyond the training record; below 3: none");
  }
};

/// The pieces a run is made of, borrowed for its duration.
struct Pieces {
  const SubspaceEstimator& subspace;
  const InputReconstructor& inversion;
  std::function<std::unique_ptr<StaticMap>(Index inputs, Index outputs)> make_map;
  const Solver& solver;
  RidgeFactory make_ridge;  ///< of PipelineOptions::alternative_map; empty: the refinement keeps the map it began with
};

/// RMS of every channel on the training record; signals are divided by it.
struct Scaling {
  Vector u, y;
};

/// The auxiliary input along the training record and the states it leads to, of unit covariance.
struct InputTrajectory {
  Matrix f, x;                 ///< q x N, n x N
  Index first = 0, count = 0;  ///< samples that the inversion calls trustworthy; nothing is fitted to the rest
};

/// One round of steps 3 to 5.
struct Pass {
  Status status = Status::failed;
  std::string message;
  double input_variance = 0;  ///< Q_eta / R_v of the inversion
  double map_residual = 0;    ///< of the static map's fit, relative
  Decomposition split;        ///< eq. (4) on the reconstructed states
  InputTrajectory along;      ///< steps 3 and 4, where they are kept; empty where the inversion failed
  NonlinearModel model;
  Vector x0;
  Vector training_vaf;  ///< p, free run
  double score = 0;     ///< mean of training_vaf, -infinity if the free run diverged
};

/// The joint refinement: `rounds` short ones from maps fitted anew, then a long one from the best of them, or the
/// polynomial of one direction that beats it.
struct Refinements {
  std::vector<double> round_costs;  ///< 1/2 ||r||^2 after each short one; infinity where it failed
  Solution solution;                ///< of the last one; iterations 0 if no refinement was asked for
};

struct PipelineResult {
  Status status = Status::failed;  ///< that of the whole; failures of single passes stand in `passes`
  std::string message;
  Scaling scaling;
  LinearEstimate linear;     ///< step 1
  Solution output_error;     ///< of PipelineOptions::linear_iterations; step 1 stands as it was unless it is usable
  Direction direction;       ///< step 2
  std::vector<Pass> passes;  ///< steps 3 to 5
  Index best = -1;           ///< index of the best pass; -1 of a linear model
  NonlinearModel model;      ///< of the best pass, refined if asked
  Vector x0;
  Refinements refinement;
};

/// @param data training record   @param random supplies the initial guesses
PipelineResult run_pipeline(const Signal& data, const PipelineOptions& options, const Pieces& pieces, Random& random);

/// The same on a record that is scaled already; scaling is left empty.
PipelineResult run_scaled_pipeline(const SignalView& scaled, const PipelineOptions& options, const Pieces& pieces,
                                   Random& random);

/// Steps 1 to 5 alone, model = best pass, on a record that is scaled already.
PipelineResult run_passes(const SignalView& scaled, const PipelineOptions& options, const Pieces& pieces,
                          Random& random);

}  // namespace wheelhop
