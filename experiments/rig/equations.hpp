/// \file
/// The right-hand side of the rig's equations of motion.
#pragma once

#include "experiments/rig/rig.hpp"

namespace wheelhop::blind {

/// State: positions and velocities of the masses, then the states of the mounts in their order.
class Equations {
 public:
  Equations(const Plan& plan, const Vector& theta, const std::vector<Mount>& mounts);

  Index size() const { return size_; }
  void set_inputs(const double* u, const double* u_rate);
  void rates(double t, const Vector& state, Vector& rate);
  void accept(double t, const Vector& state);
  /// Of the state and rate at which `rates` was called last.
  void outputs(double* y) const;
  double travel(std::size_t element) const {
    return position_[elements_[element].to] - position_[elements_[element].from];
  }
  double travel_rate(std::size_t element) const {
    return speed_[elements_[element].to] - speed_[elements_[element].from];
  }

 private:
  struct Mounted {
    std::unique_ptr<Attachment> attachment;
    Index offset = 0;  ///< of its states
  };
  struct Link {
    std::size_t from = 0, to = 0;
    BaseLaws laws;
    std::vector<Mounted> mounted;
  };
  void place(const Vector& state);

  const Plan& plan_;
  Index n_ = 0, size_ = 0;
  Vector masses_;
  std::vector<Link> elements_;
  std::vector<std::vector<Mounted>> on_mass_;
  std::vector<double> position_, speed_, force_, acceleration_, u_;
};

}  // namespace wheelhop::blind
