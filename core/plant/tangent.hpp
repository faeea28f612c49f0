/// \file
/// How a simulation changes with its parameters, its drive and its initial state: the variational equations
///   (dx/dp)' = df/dx dx/dp + df/dp,
/// first-order forward sensitivities, carried along by the simulation's own Runge-Kutta steps. E. Hairer, S. P.
/// Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd ed., section I.14.
#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "core/plant/motion.hpp"

namespace wheelhop {

/// A direction in which a simulation is varied.
struct Variation {
  /// A plant of the same graph and laws with other numbers, `step` away in this direction; nullptr: the plant itself.
  const Plant* neighbour = nullptr;
  double step = 1e-4;       ///< small, of either sign
  Vector initial = {};      ///< change of the initial state, 2n or 2n + s; empty: 0
  Matrix drive = {};        ///< change of the drive as the plant feels it, m x N; empty: 0
  Matrix sampled = {};      ///< that of `SimulateOptions::sampled_drive`; empty: as `drive`
  Index kept_samples = -1;  ///< the change counts as faded to 0 after so many kept samples; -1: never
};

/// The changes of one simulation in all its directions, each per unit of its `step`. `simulate` calls the functions in
/// the order in which they stand here. What follows from the state is linear in the slopes of the laws; what a
/// neighbour's numbers do at a given motion is a difference over `step`, of its own elements alone. At a corner of a
/// law (contact, clearance) the slope is that of one side. Cost: the slopes of all laws once a stage, the laws of each
/// neighbour's own elements, and some twenty products an element, stage and direction.
class Tangent {
 public:
  /// @param variations kept by reference, those that never fade first, then by falling `kept_samples`
  Tangent(const Plant& plant, const std::vector<Variation>& variations, Index kept_samples);

  /// At the start of sample k, before the memories z follow the drives' steps. @param step m
  void step_memories(const Motion& motion, Index k, const double* step, const double* z);
  /// @param sampled for accelerations at the sample itself, else over the interval behind it
  void set_inputs(const Motion& motion, Index k, bool sampled, double hold_s);
  /// First stage of a step. @param motion as the `accelerations` a at memories z left it.
  /// @return as `Motion::accelerations`
  int begin(Motion& motion, const double* z, const double* a);
  /// The changes of the readings at the state of `begin`, to a column of the outputs.
  void read(const Motion& motion, Index column);
  /// A further stage, c after the start of the step, with the weight of its slopes in the step's sum.
  int stage(double c, double weight, Motion& motion, const double* z, const double* a);
  void finish(double h);

  /// p x kept samples a direction.
  std::vector<Matrix> outputs;
  /// False of a direction whose neighbour left the domain of its laws on the way.
  std::vector<char> defined;

 private:
  /// One row of `stride` numbers, one a direction, for each node, mass or memory.
  class Rows {
   public:
    void resize(Index rows, Index stride) {
      stride_ = stride;
      values_.assign(static_cast<std::size_t>(rows * stride), 0);
    }
    double* row(std::size_t i) { return values_.data() + static_cast<std::size_t>(stride_) * i; }
    const double* row(std::size_t i) const { return values_.data() + static_cast<std::size_t>(stride_) * i; }
    void clear() { std::fill(values_.begin(), values_.end(), 0.0); }

   private:
    Index stride_ = 0;
    std::vector<double> values_;
  };
  /// How the numbers of a neighbour act on one element at a given motion, over the step.
  struct OwnChange {
    std::size_t direction, element;
    enum { linear, gradient, law, memory, whole } by;
    double stiffness_n_per_m = 0, damping_ns_per_m = 0;  // linear: of the laws of constant slopes together
    std::size_t which = 0, state = 0;                    // gradient, law, memory: which one, and its first state
    std::vector<double> values = {};                     // gradient: change of the law's values
  };
  struct OwnMass {
    std::size_t direction, mass;
    double share;  // change of its acceleration, per acceleration
  };
  void add_neighbour(const Plant& plant, const Motion& motion, std::size_t direction);
  int evaluate(Motion& motion, const double* z, const double* a);
  void own_changes(const Motion& motion, const double* z, const double* a);
  bool own_change(const Motion& motion, const OwnChange& own, const double* z);

  const std::vector<Variation>& variations_;
  std::size_t masses_, memories_ = 0, active_, stride_ = 0;
  std::vector<Motion> neighbours_;         // those that differ in an element
  std::vector<std::size_t> neighbour_of_;  // of a direction; beyond the list: none
  std::vector<OwnChange> changes_;
  std::vector<OwnMass> own_masses_;
  std::vector<std::size_t> driven_;  // directions that change the drive
  Rows q_, v_, z_;                   // at the start of the step
  Rows x_, w_, y_;                   // positions and velocities of the nodes, memories: of a stage
  Rows a_, r_;                       // accelerations and rates of the memories there
  Rows sum_q_, sum_v_, sum_z_;       // weighted sums of the slopes so far
  Rows force_, applied_, travel_, rate_, free_rate_, own_force_, own_rate_;
  std::vector<Motion::ElementSlopes> elements_;
  std::vector<MemorySlopes> laws_;
  std::vector<double> here_, there_;            // rates of the memories, of the plant itself and of a neighbour
  std::vector<std::vector<double>> gradients_;  // of the laws at this stage, as far as asked for
  std::vector<char> known_;                     // whether
};

}  // namespace wheelhop
