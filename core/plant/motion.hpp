/// \file
/// The plant assembled for computing: node numbers instead of names, laws as flat arrays. Layout used everywhere: the
/// state is [q; v; z] (2n + s: positions, then velocities of the masses, then the internal states of the laws with
/// memory in the order of the file); `u` has one entry an input of the plant.
#pragma once

#include <vector>

#include "core/plant/plant.hpp"

namespace wheelhop {

/// Newton's equations of a plant, M a = sum of forces on the masses, M = diag(m_i) and what inerters add: b g g', g
/// what the travel of their element is made of. Built once, evaluated millions of times without allocation. Owns a copy
/// of the laws and scratch space: one object a thread.
///
/// A displacement drive that is held moves its node in steps. Its velocity (which only laws that read the rate of an
/// element at that node see) is an argument of its own, `u_rate`, decided by the simulation.
class Motion {
 public:
  explicit Motion(const Plant& plant);

  Index masses() const { return static_cast<Index>(mass_.size()); }
  Index inputs() const { return static_cast<Index>(inputs_.size()); }
  Index memories() const { return static_cast<Index>(rest_.size()); }  ///< internal states of all laws
  Index sensors() const { return static_cast<Index>(sensors_.size()); }

  /// Sets the inputs for the evaluations that follow. @param u, u_rate m values (u_rate of a force is not read).
  void set_inputs(const double* u, const double* u_rate);
  /// Of the inputs (m values) those that set numbers of laws (schedule.hpp); `set_inputs` does so too.
  void set_schedules(const double* u);
  bool has_schedules() const { return !scheduled_.empty(); }
  /// The memories (s) after the displacement drives have moved by `step` (m values): laws that know how a step acts.
  void step_memories(const double* step, double* z) const;

  static constexpr int all_defined = -1;
  /// Accelerations a (n) at positions q and velocities v (n) under the inputs set before.
  /// @return `all_defined`, or the index of the first element whose law is outside its domain or not finite.
  int accelerations(const double* q, const double* v, double* a) {
    return accelerations(q, v, rest_.data(), a, z_rate_.data());
  }
  /// The same with memories z (s); their rates z' are written to `z_rate`. The overload above has them at rest.
  int accelerations(const double* q, const double* v, const double* z, double* a, double* z_rate);

  /// Positions and velocities for what reads the evaluation before, without an evaluation.
  void place(const double* q, const double* v);

  /// Fastest decay [1/s] of an internal state that yields at the speeds of the evaluation before: at rest friction with
  /// presliding has no rate.
  double fastest_yielding() const;

  /// Travel [m] of an element in the evaluation before.
  double travel(int element) const;
  /// Force [N] of an element in the `accelerations` before: the sum of its laws, clearance and contact included, that
  /// pulls its second node toward its first. Written only if that evaluation was defined.
  double element_force(Index element) const { return element_force_[static_cast<std::size_t>(element)]; }

  /// Sensor readings y (p) at a state and its accelerations, under the inputs set before; memories at rest. NaN of a
  /// force sensor whose element is outside the domain of its laws.
  void outputs(const double* q, const double* v, const double* a, double* y) { outputs(q, v, rest_.data(), a, y); }
  /// The same with memories z (s).
  void outputs(const double* q, const double* v, const double* z, const double* a, double* y);

  /// Slopes of the forces: stiffness and damping matrices (nodes x nodes, symmetric), such that small changes of the
  /// positions dx and velocities dv of masses and inputs give force = -stiffness dx - damping dv on them. Rows and
  /// columns of rigid points are carried over to their masses and zero. Return value as `accelerations`.
  int slopes(const double* q, const double* v, Matrix& stiffness, Matrix& damping);
  /// The same for laws with memory: small changes dz give force + memory_force dz, and
  /// z' = memory_travel dx + memory_rate dv + memory dz.
  struct Slopes {
    Matrix stiffness, damping;          // nodes x nodes
    Matrix memory_force;                // nodes x s
    Matrix memory_travel, memory_rate;  // s x nodes
    Matrix memory;                      // s x s
    // What the laws of its element add to a force sensor's reading, a row a sensor; zero of other sensors, and without
    // inerters. Columns as above.
    Matrix sensed_stiffness, sensed_damping;  // p x nodes
    Matrix sensed_memory;                     // p x s
  };
  int slopes(const double* q, const double* v, const double* z, Slopes& result);

  /// The clearances of `backlash` laws transmit this share of the travel inside them: 0 unless set. With a share above
  /// 0 every position has its own force, which a search for an equilibrium needs.
  void set_play_leak(double share) { play_leak_ = share; }
  bool has_play() const;
  bool held() const { return held_; }  ///< the drives move in steps, else smoothly

  struct Energy {
    double kinetic_j = 0;
    double potential_j = 0;   ///< stored in the laws
    double dissipated_w = 0;  ///< heat in the laws. Signed where a law stands for a part of a damper only, and while an
                              ///< element has lifted off: what its springs would store goes there and comes back
    double input_w = 0;       ///< by forces, and by moving drive nodes through `u_rate`; position steps of a held drive
                              ///< change potential_j
    int undefined_element = all_defined;
  };
  Energy energy(const double* q, const double* v) { return energy(q, v, rest_.data()); }
  Energy energy(const double* q, const double* v, const double* z);

  /// Slopes of one element's force and of its memories' rates. Travel, rate and force are those of the whole element.
  struct ElementSlopes {
    double stiffness_n_per_m = 0, damping_ns_per_m = 0;  ///< of the laws without memory, as far as they pull
    double pulling = 1;                                  ///< 0 while a contact has let go: no force answers a change
    double followed = 1;  ///< share of a change of the travel that the laws see; less inside a clearance
  };
  /// At the state of the `accelerations` before. @param elements one each @param laws one a law with memory, as their
  /// states stand in z. @return as `accelerations`
  int slopes_here(const double* z, ElementSlopes* elements, MemorySlopes* laws);

  double mass_kg(Index i) const { return mass_[static_cast<std::size_t>(i)]; }
  double inertance_kg(Index element) const { return branches_[static_cast<std::size_t>(element)].inertance_kg; }
  /// True if the plant has an inerter, of whatever size: M and its inverse may be full.
  bool coupled() const { return !inverse_matrix_.empty(); }
  Matrix mass_matrix() const;          ///< M, n x n [kg]
  Matrix inverse_mass_matrix() const;  ///< of M, exactly diagonal where it is not coupled
  /// Acceleration of mass i under forces on the masses (n values).
  double accelerated(const double* forces, std::size_t i) const {
    if (inverse_matrix_.empty()) return forces[i] * inverse_mass_[i];
    const double* const row = inverse_matrix_.data() + mass_.size() * i;
    double sum = 0;
    for (std::size_t j = 0; j < mass_.size(); ++j) sum += row[j] * forces[j];
    return sum;
  }
  Index node_count() const { return static_cast<Index>(x_.size()); }
  /// Node of a displacement input, -1 for one of another kind.
  Index input_node(Index input) const { return inputs_[static_cast<std::size_t>(input)].node; }
  /// Forces on the masses (n) per unit of an input that moves no node: -1 and +1 where a force acts, -m where the
  /// ground accelerates; 0 of a schedule.
  Vector input_forces(Index input) const;
  /// True of an input that accelerates the ground.
  bool accelerates_ground(Index input) const { return inputs_[static_cast<std::size_t>(input)].accelerates_ground; }
  /// Element inside which a force input acts, -1: none.
  Index force_inside(Index input) const { return inputs_[static_cast<std::size_t>(input)].inside; }
  /// Constant forces of the loads on the masses (n), those on points by their weights [N].
  Vector load_forces() const;
  struct Weight {
    Index mass;
    double value;
  };
  /// What the displacement of a node is made of: a mass itself, the masses of a rigid point, nothing for the others.
  const std::vector<Weight>& weights(Index node) const { return weights_[static_cast<std::size_t>(node)]; }
  struct SensorPlace {
    SensorKind kind;
    Index from, to;  // ends of the element of a force sensor
    Index element = -1;
    double ground = 0;  // of an accelerometer: share of the ground's acceleration in its reading
  };
  const SensorPlace& sensor(Index i) const { return sensors_[static_cast<std::size_t>(i)]; }

  /// Laws with memory, which is how many `slopes_here` writes.
  Index memory_laws() const;

 private:
  friend class Tangent;
  template <class V, int N>
  friend class MatrixMotion;
  struct Branch {
    std::size_t from, to, first_law, last_law;
    std::size_t first_curved;                    // laws [first_curved, first_memory) are nonlinear ...
    double stiffness_n_per_m, damping_ns_per_m;  // ... those before are summed here ...
    std::size_t first_memory;                    // ... those from here on have states, z[first_state] the first
    std::size_t first_state;
    int driven;  // input that moves an end, -1: none; a positive step of it changes the travel by driven_sign
    double driven_sign;
    int driven_too;  // input that moves the other end as well, with the other sign, -1: none
    bool modified;   // by a clearance, a contact or a shifted working point
    double play_m, contact_n, offset_m;
    double rest_force_n;  // of the laws at the working point
    double inertance_kg;
  };
  struct Drive {
    Index node;  // of a displacement
    Index from, to;
    Index inside = -1;
    bool accelerates_ground = false;
    bool pushes() const { return node < 0 && from >= 0; }  // it is a force
  };
  /// A number of a law that follows an input.
  struct Scheduled {
    std::size_t law, value, input;
    double at_zero, slope;
    Range range;  // of the input
  };
  struct RigidPoint {
    std::size_t node;
    std::vector<Weight> weights;
  };
  double effective_travel(const Branch& branch, double travel) const;
  bool slopes_of(std::size_t element, const double* z, ElementSlopes& slopes, MemorySlopes* laws);
  bool force(const Branch& branch, double travel, double rate, double free_rate, const double* z, double& sum,
             double* z_rate) const;
  bool element(const Branch& branch, double own_travel, double rate, double free_rate, const double* z, double& sum,
               double* z_rate) const;
  double free_rate(const Branch& branch, double rate) const;
  /// What inputs (m values) make of the travel of an element that they drive.
  static double driven_by(const Branch& branch, const double* inputs) {
    const double other = branch.driven_too >= 0 ? inputs[branch.driven_too] : 0;
    return branch.driven_sign * (inputs[branch.driven] - other);
  }
  double force_reading(std::size_t element, const double* q, const double* v, const double* z, const double* a);
  double reading(SensorKind kind, Index node, const double* q, const double* v, const double* a) const;

  void couple();
  std::vector<double> mass_, inverse_mass_;  // those of the masses alone
  std::vector<double> inverse_matrix_;       // of M, a row a mass; empty where no inerter couples them
  std::vector<Branch> branches_;
  std::vector<Law> laws_;                     // with their numbers at the inputs set before
  std::vector<Scheduled> scheduled_;          // in the order of the laws
  std::vector<double> schedules_;             // the inputs that they follow now
  std::vector<RigidPoint> points_;            // the last nodes
  std::vector<std::vector<Weight>> weights_;  // of every node
  std::vector<Drive> inputs_;
  std::vector<SensorPlace> sensors_;
  std::vector<double> x_, v_, force_, applied_;  // one entry a node
  std::vector<double> loads_;                    // of applied_, what is constant
  std::vector<double> carried_;                  // one entry a mass: 1, or 0 of one that turns
  double ground_acceleration_ = 0;               // [m/s^2]
  std::vector<double> inside_;                   // one entry an element: forces of inputs that act inside it
  std::vector<double> rest_, z_rate_;            // one entry a memory: zeros, and scratch
  std::vector<double> element_force_;            // one entry an element
  double play_leak_ = 0;
  bool held_ = true;
};

}  // namespace wheelhop
