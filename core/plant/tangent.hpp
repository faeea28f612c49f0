/// \file
/// How a simulation changes with its parameters, its drive and its initial state: the variational equations
///   (dx/dp)' = df/dx dx/dp + df/dp,
/// first-order forward sensitivities, carried along by the simulation's own Runge-Kutta steps. E. Hairer, S. P.
/// Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd ed., section I.14.
#pragma once

#include <vector>

#include "core/plant/lanes.hpp"
#include "core/plant/motion.hpp"

namespace wheelhop {

/// A direction in which a simulation is varied.
struct Variation {
  /// A plant of the same graph and laws with other numbers, `step` away in this direction; nullptr: the plant itself.
  const Plant* neighbour = nullptr;
  double step = 1e-4;   ///< small, of either sign
  Vector initial = {};  ///< change of the initial state, 2n or 2n + s; empty: 0
  Matrix drive = {};    ///< change of the drive as the plant feels it, m x N; empty: 0
  Matrix sampled = {};  ///< that of `SimulateOptions::sampled_drive`; empty: as `drive`
  Vector stored = {};   ///< change of `SimulateOptions::stored`, where that is given; read by `simulate_varied` only
  Index kept_samples = -1;  ///< the change counts as faded to 0 after so many kept samples; -1: never
};

/// The changes of one simulation in all its directions, each per unit of its `step`. `simulate` calls the functions in
/// the order in which they stand here. What follows from the state is linear in the slopes of the laws; what a
/// neighbour's numbers do at a given motion is linear in them too where a law gives its gradient, else a difference
/// over `step`, of its own elements alone. At a corner of a law (contact, clearance) the slope is that of one side.
///
/// Four directions go through a stage at once, a lane of a vector register each, with their state in registers. Cost:
/// the slopes of all curved laws once a stage, and some ten multiply-adds an element, stage and four directions.
class Tangent {
 public:
  /// @param variations kept by reference, those that never fade first, then by falling `kept_samples`
  Tangent(const Plant& plant, const std::vector<Variation>& variations, Index kept_samples);

  /// At the start of sample k, before the memories z follow the drives' steps. @param step m
  void step_memories(const Motion& motion, Index k, const double* step, const double* z);
  /// @param sampled for accelerations at the sample itself, else over the interval behind it
  /// @param fraction of the interval that has passed, where the drives are not held
  void set_inputs(const Motion& motion, Index k, bool sampled, double hold_s, double fraction = 0);
  /// First stage of a step. @param motion placed at the state @param z its memories @param a its accelerations
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
  /// A table of numbers, a column a direction: four neighbouring directions are one `Lanes`, and all rows of these four
  /// stand together.
  class Rows {
   public:
    void resize(std::size_t rows, std::size_t directions) {
      rows_ = rows;
      values_.assign(rows * ((directions + 3) / 4), Lanes(0.0));
    }
    Lanes* block(std::size_t four) { return values_.data() + rows_ * four; }
    void set(std::size_t row, std::size_t direction, double value) { at(row, direction).set(lane(direction), value); }
    double get(std::size_t row, std::size_t direction) { return at(row, direction)[lane(direction)]; }
    void add(std::size_t row, std::size_t direction, double value) { set(row, direction, get(row, direction) + value); }
    void clear() { std::fill(values_.begin(), values_.end(), Lanes(0.0)); }

   private:
    static int lane(std::size_t direction) { return static_cast<int>(direction % 4); }
    Lanes& at(std::size_t row, std::size_t direction) { return values_[rows_ * (direction / 4) + row]; }
    std::size_t rows_ = 0;
    std::vector<Lanes> values_;
  };
  /// A row of what neighbours change, and what it is multiplied with at the present stage.
  struct Term {
    enum { travel, rate, gradient, own } by;
    std::size_t row;
    std::size_t law = 0, value = 0;  // gradient
    double factor = 1;
  };
  struct Part {
    std::vector<double> g, pull;  // what the travel is made of, one a mass; M^-1 times that
    int driven;
    double driven_sign;
    int driven_too;  // with the other sign
    int sensed;      // row of its force, -1: no sensor reads it
    bool constant;   // its slopes never change
    std::size_t first_law_slopes;
    std::vector<Term> terms;
  };
  /// How the numbers of a neighbour act on one element at a given motion, as a difference over the step.
  struct OwnChange {
    std::size_t direction, element;
    enum { law, memory, whole } by;
    std::size_t row;                   // of its term
    std::size_t which = 0, state = 0;  // law, memory: which one, and its first state
  };
  void add_neighbour(const Plant& plant, const Plant& other, const Motion& motion, std::size_t direction);
  /// Sets in all neighbours the numbers of laws that follow drives, at the present drives as their direction has them.
  void follow_schedules(const Motion& motion, Index k, bool sampled, double fraction);
  struct DriveChange {
    double value, rate;
  };
  /// Change of a drive in a direction that changes drives, at the instant that `set_inputs` is told.
  DriveChange change_of_drive(const Motion& motion, const Variation& variation, Index input, Index k, bool sampled,
                              double hold_s, double fraction) const;
  std::size_t term_row(std::size_t element, const Term& term);
  int prepare_stage(Motion& motion, const double* z, const double* a);
  bool own_change(const Motion& motion, const OwnChange& own, const double* z);
  template <int N>
  void evaluate(const Motion& motion, std::size_t four, const Lanes* x, const Lanes* w, const Lanes* y, Lanes* a,
                Lanes* r);
  template <int N>
  void all_stages(const Motion& motion, bool first, double c, double weight);
  void all_stages(const Motion& motion, bool first, double c, double weight);
  std::size_t fours() const { return (active_ + 3) / 4; }

  const std::vector<Variation>& variations_;
  std::size_t masses_, memories_ = 0, active_;
  std::vector<Motion> neighbours_;         // those that differ in an element or in what its laws follow
  std::vector<std::size_t> neighbour_of_;  // of a direction; beyond the list: none
  std::vector<double> followed_;           // scratch: inputs of one direction
  std::vector<Part> parts_;                // one an element
  std::vector<OwnChange> changes_;
  std::vector<std::vector<double>> term_values_;  // a row a term, until all neighbours are known
  Rows terms_;                                    // what neighbours change
  Rows own_rate_;                                 // what neighbours change in the rates of memories
  Rows loads_;                                    // constant forces on the masses, as far as neighbours change them
  bool loads_change_ = false;
  Rows ground_;  // forces on the masses per acceleration of the ground, as far as neighbours change them
  bool ground_changes_ = false;
  Rows forces_;      // of the elements that force sensors read, at the present stage; without inerters
  Rows inertances_;  // of these elements
  Rows shares_;      // change of a mass's acceleration, per acceleration; where
                     // inerters couple them per that of each, a row a mass
  bool coupled_ = false;
  bool masses_change_ = false;
  std::vector<std::size_t> driven_;  // directions that change the drive
  Rows state_;                       // [q; v; z] at the start of the step
  Rows stage_;                       // [w; a; r] of the stage before: slopes of [q; v; z]
  Rows sum_;                         // weighted sums of these
  Rows inputs_;                      // [u; u'], one each an input; of forces u alone
  Rows applied_;                     // forces on the masses
  std::vector<double> accelerations_;
  std::vector<Motion::ElementSlopes> elements_;
  std::vector<MemorySlopes> laws_;
  std::vector<double> here_, there_;            // rates of the memories, of the plant itself and of a neighbour
  std::vector<std::vector<double>> gradients_;  // of the laws at this stage, as far as asked for
  std::vector<char> asked_;                     // whether
  std::vector<Lanes> scratch_;                  // for any number of masses
};

}  // namespace wheelhop
