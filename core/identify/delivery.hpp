/// \file
/// The model that is delivered: of the linear model, the best pass and the refined model the one with the best free run
/// on samples that none of them was fitted to, then fitted once more to all records.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/identify/candidates.hpp"
#include "core/identify/initial_state.hpp"
#include "core/identify/linear_search.hpp"
#include "core/identify/pipeline.hpp"
#include "core/identify/uncertainty.hpp"

namespace wheelhop {

struct DeliveryOptions {
  PipelineOptions pipeline;
  std::optional<LinearSearchOptions> search;  ///< step 1 by search_linear(); none: by the piece that is given
  bool choose_direct_term = false;            ///< also without Dt where the record asks for it
  Index initial_state_samples = 0;            ///< of a record that is not fitted; 0: initial_state_span()
  Index starts = 0;                           ///< of the pipeline from other initial guesses; 0: starts_for()
  bool cut_off_outputs = true;                ///< look for limits of the outputs, find_output_limits()
};

/// Channels as the models see them: (u - u_offset) ./ u_scale and y ./ y_scale, inputs late by `delay` samples.
struct Channels {
  Vector u_offset, u_scale, y_scale;
  std::vector<Index> delay;
};

struct Delivery {
  Status status = Status::failed;
  std::string message;  ///< where there is no model, or how the refinement failed
  Channels channels;
  OutputLimits limits;  ///< p, units of the records; those of `model` are these over channels.y_scale
  std::optional<LinearSearch> search;
  PipelineResult pipeline;  ///< the run of the model chosen; its steps on the fitted part
  std::vector<Candidate> candidates;
  std::size_t chosen = 0;
  std::string held_out;  ///< what the candidates were compared on
  std::string reason;    ///< why this one
  Vector unexplained;    ///< p, residual_share() of the delivered model on all records
  LinearModel linear;    ///< the linear candidate, fitted to all records as well
  NonlinearModel model;
  std::vector<Vector> x0;                 ///< of every record at its sample longest(delay)
  StateStatistics states, linear_states;  ///< of `model` and `linear` on all records
  ModelUncertainty uncertainty;           ///< of `model`, in the units of the models
};

/// Starts of the pipeline from other initial guesses on so many fitted samples and at that order. Short records let
/// free maps end in poor minima, and there a start costs little.
Index starts_for(Index samples, Index order);

/// Steps:
/// 1. Offsets larger than the motion are taken out of inputs and outputs, all channels are scaled to unit RMS.
///    An output that was cut off gives the models its limits: a sample there counts as an error only of a model that
///    stays inside.
/// 2. The first three quarters of every record are fitted, the rest is held out. Where the longest record is too short
///    for the pieces by then, nothing is held out.
/// 3. Linear model, passes and refinement on the longest record's part (run_scaled_pipeline), from `starts` initial
///    guesses; of the passes and of the refined models the best one is a candidate. The linear and the refined model
///    then on all fitted parts at once, each part with its own initial state. The same without Dt as well, where that
///    is asked for and what is left is neither noise nor a tenth of the linear model's error.
/// 4. The candidate with the least mean log NRMSE on the held-out parts, among those that are in no output worse than
///    the linear model and hold on other drives of the same kind (excursion()); the linear model where none is better
///    by more than 2 % and by more than chance. So what is delivered is at least as good there as its linear part and
///    as the unrefined pass.
/// 5. Where the order was found by the search: the pipeline with higher orders as long as what is left is more than
///    noise and they bring something, with lower ones as long as no nonlinearity is found. Then with every lower order
///    than that of a nonlinear model: the lowest one that does as well is taken.
/// 6. Where that one holds the alternative map and leaves more than noise, the pipeline without that map: its model is
///    taken if it is nearly as good, as it holds farther beyond the records.
/// 7. Where the model chosen holds the map as given, leaves more than noise and has a hundred fitted samples for
///    each parameter, its refinement goes on. Then the same with twice and with four times the features, as long as
///    each of these brings more than 3 %.
/// 8. The refinement of the model chosen on all records from end to end. It is kept where it is no worse on the parts
///    that were held out and holds on other drives. Where there were several starts and the model leaves more than
///    noise, all starts of its form are refined so. Of those that fit within a quarter of the best, the one is
///    delivered whose outputs on other drives are nearest to those of the others (their medoid).
///
/// @param records of one set of channels, at least one   @param pieces subspace is not used where `search` is given
/// Status: rank_deficient without a linear model, or where a record is shorter than the delays; outside_domain where
/// every candidate diverges.
/// Cost: that of the pipeline and its starts, once or twice and once for every other order; with a wider map up to
/// three refinements of twice the iterations; one refinement on all records, with several starts two for each of them.
Delivery deliver(std::vector<Signal> records, const DeliveryOptions& options, const Pieces& pieces, Random& random);

}  // namespace wheelhop
