/// \file
/// Time simulation of a plant, and its static equilibrium.
#pragma once

#include <string>
#include <vector>

#include "core/base/status.hpp"
#include "core/data/signal.hpp"
#include "core/plant/motion.hpp"

namespace wheelhop {

class Tangent;

struct Equilibrium {
  Status status = Status::ok;
  std::string message;
  Vector positions;  ///< n [m]
};

/// Positions at which all masses rest under constant inputs, memories at rest: sum of forces = 0. Damped Newton from
/// the equilibrium of the plant linearised at zero; where a mass may drift freely, the solution nearest to zero.
/// @param u m constant inputs.  Statuses: rank_deficient (a force that no spring balances), outside_domain,
/// iteration_limit. Cost O(n^3) an iteration, at most 100.
Equilibrium static_equilibrium(const Plant& plant, ConstVectorRef u);

struct SimulateOptions {
  Index substeps = 1;             ///< RK4 steps in one hold interval, >= 1
  Index most_substeps = 1;        ///< where laws with memory yield too fast for those: as many as they ask for, at most
  Index decimation = 1;           ///< every how many hold samples one is kept, >= 1
  Index lead_samples = 0;         ///< hold samples at the start that are simulated but not kept
  bool from_equilibrium = false;  ///< start at rest in the equilibrium of the first drive sample
  bool or_at_zero = false;        ///< with the former: at rest at zero where no spring balances the first sample
  Matrix sampled_drive = {};      ///< m x N, what accelerations at the samples read; empty: the drive
  Vector initial_state = {};      ///< 2n [q; v] with memories at rest, or 2n + s; empty: zero, or the equilibrium
  Vector stored = {};  ///< as in `apply_sensor_paths`; read by `simulate_measured` and `simulate_varied` only
};

struct Simulation {
  Status status = Status::ok;
  std::string message;
  Matrix states;   ///< (2n + s) x K, positions, velocities, then internal states of the laws, at the kept samples
  Matrix outputs;  ///< p x K sensors at the kept samples; fewer columns than asked for if the status is not ok
  double failure_time_s = 0;  ///< where the status is not ok; 0 is the first kept sample
};

/// Integrates M q'' = forces(q, q', u) by classical Runge-Kutta of fourth order, the drive held over each interval.
///
/// Drives that are not held (`PlantInput::held`) follow the curve of drive_course.hpp through their samples in every
/// stage, and the velocity of a displacement drive is its slope; no memory steps. The next paragraph is about drives
/// that are held.
///
/// Accelerations and the forces of elements are those of the equation of motion at the sample itself, not differences
/// of velocities. The velocity of a displacement drive, which only rate-dependent laws at the drive node see, is
/// (u_k - u_{k-1}) / T over interval k (0 in the first): the drive's step at t_k spread over the interval that follows.
/// It hands such a damper exactly the momentum of the step it replaces, needs no future sample, and lags by half an
/// interval. Laws with memory that know what a step does (`LawMemory::jump`) take it at t_k instead.
///
/// @param drive m x N at the plant's hold rate, in the units of the inputs.
/// Statuses: outside_domain with time and element, if in any Runge-Kutta stage a law has left its domain or is no
/// longer finite, and at the start if one leaves its numbers' ranges within those of the drives that it follows; those
/// of `static_equilibrium`; not_finite if the drive or the initial state is not finite. UserError on wrong shapes. The
/// step has to suit the stiffest law; see `stable_substeps`. Cost: 4 substeps N evaluations of the plant; nothing is
/// allocated inside the loop.
/// @param tangent carried along, made for this plant and as many samples as are kept; nullptr: none
Simulation simulate(const Plant& plant, ConstMatrixRef drive, const SimulateOptions& options = {},
                    Tangent* tangent = nullptr);

/// One of several simulations.
struct SimulationTask {
  const Plant* plant;
  const Matrix* drive;
  SimulateOptions options = {};
};

/// The same results as one `simulate` after the other, to round-off, with statuses of their own. Those of equal graph,
/// laws and steps run four at a time, a lane of a vector register each, unless laws with memory choose their
/// own steps: realisations, records of one plant, variations of its parameters. Of four, the time is about that of one
/// and a half.
std::vector<Simulation> simulate_side_by_side(const std::vector<SimulationTask>& tasks);

/// Substeps with which every pole of the plant linearised at zero lies well inside the stability region of the
/// integrator, |s| h <= 2, at most `cap`. Smoothed friction is stiffest there; an end stop is not seen. Internal states
/// of laws are also judged at 1 m/s: friction with presliding over 0.1 mm is stiff in motion only. At least 1,
/// also where the plant cannot be linearised. Schedules count at either end of their ranges. Cost O((2n + s)^3).
Index stable_substeps(const Plant& plant, Index cap = 1000);

/// Options for many simulations, with a fraction of those steps: internal states are judged interval by interval, at
/// the speed that the element has there.
/// @param cap of the steps for the plant linearised at zero   @param most of those for internal states, >= cap
SimulateOptions sparing_steps(const Plant& plant, Index cap, Index most);

}  // namespace wheelhop
