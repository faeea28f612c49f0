/// \file
/// The diagnosis: whether there is a gap between a plant and its records, where it lies, which effect causes it, and
/// how far it shrinks with that effect. Fits and simulations gather evidence, `decide` makes the verdict of it, and
/// what the verdict asks for is then computed: the plant with the answer, checks, shares, a test that would tell rivals
/// apart.
///
/// Terms, here and in the folders below:
///   misfit     reduced chi-square: mean of r^2, r = (simulated - measured) over the noise floor; 1 at the floor
///   chi2       sum of r^2 over fitted and held-out records, and of the squared priors of the parameters
///   stage      the plant on the held-out records: as delivered, re-tuned inside the tolerances, with the answer
///   place      where something may be wrong: element, mass, guide (mass to ground), sensor, actuator, clock
///   leftover   reduced chi-square that an unknown signal at a place leaves
///   candidate  effects at places, in a form; a single or a pair
///   screen     linear forecast of what a candidate would gain, from one simulation
///   posterior  probability of a candidate among its rivals
///   z          leave-prior-out z of a parameter: how far the data alone put it from the plant file, in tolerances
///   freed      a parameter without its tolerance
///   closure    share of a gap that goes
#pragma once

#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "core/gap/checks.hpp"
#include "core/gap/evidence/noise_floor.hpp"
#include "core/gap/verdict/decide.hpp"
#include "core/gap/which/search.hpp"

namespace wheelhop {

struct DiagnoseOptions {
  Index iterations = 12;  ///< cap of each fit
  double block_s = 2;     ///< of the bootstrap
  Index draws = 2000;
  Thresholds thresholds = {};
  SearchEffort effort = {};
};

/// What is computed once the verdict is known.
struct FollowUp {
  std::vector<PlaceLeftover> places_left;  ///< places of the plant with the effects named; empty if none is added
  Vector shares;                           ///< of the effects named in the closure, as effect_shares; of several
  std::vector<Check> checks;
  SeparatingTest separating;  ///< of the answer and its nearest rival; `test` empty where there is none, or none helps
};

struct Diagnosis {
  Status status = Status::ok;
  NoiseFloor floor;
  Thresholds thresholds;
  SearchEffort effort;
  Evidence evidence;
  Verdict verdict;
  FollowUp follow_up;
  std::vector<Spike> spikes;     ///< bad samples of the records, bridged before anything was asked
  std::vector<SlowOutput> slow;  ///< outputs that were read less often than their records have samples
  Plant plant;                   ///< with the answer
  Plant retuned_plant;           ///< re-tuned inside the tolerances, without any effect
};

/// What a suspect (of this diagnosis) contributes to the closure of the answer; NaN if it is not one of several named.
double share_of(const Diagnosis& diagnosis, const Suspect& suspect);

/// @param candidates every effect at every place of a plant
/// @param seed of the bootstrap of closures
/// @param step called with what is being done, for a progress line; may be empty
/// Status: outside_domain if the plant as delivered cannot follow the records' drives, or a fit of it fails.
/// UserError as load_records' sets demand: noise_floor, fit_record, gap_data.
Diagnosis diagnose(const Plant& plant, const RecordSet& set, const CandidateList& candidates, const GapSolvers& solvers,
                   const DiagnoseOptions& options, std::uint64_t seed, const Step& step = {});

}  // namespace wheelhop
