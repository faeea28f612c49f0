/// \file
/// The rig: equations of motion of a plan with its true parameters and the effects mounted on it, integrated by the
/// pair of Dormand & Prince (1980) of orders 5 and 4 with step control. The drive is held between its samples, so that
/// steps end where it jumps; inside, steps shrink at kinks of the laws down to a floor below which errors are taken.
#pragma once

#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "experiments/rig/plan.hpp"

namespace wheelhop::blind {

/// The state left what the laws define (an end stop's pole) or became infinite.
class RigFailure : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Laws of an element as delivered, with their true values.
struct BaseLaws {
  struct Spring {
    double stiffness = 0, alpha = 0, beta = 0, limit = 0;  ///< limit 0: no tangent term
    std::vector<double> coefficients;                      ///< of a polynomial instead
  };
  double linear_stiffness = 0, damping = 0;
  std::vector<Spring> springs;
  double spring(double x) const;  ///< force [N]; RigFailure beyond an end stop
  double stiffness_at_rest() const;
};

/// Of one element with the parameters `theta`.
BaseLaws base_laws(const Plan& plan, const Vector& theta, Index element);

/// Forces of an element or on a mass while effects work on them.
struct Forces {
  const BaseLaws* base = nullptr;  ///< of the element; nullptr on a mass
  double spring = 0, damper = 0;   ///< as delivered, unless an effect has changed them
  double extra = 0;
  double share_at_from = 1;  ///< of the element's force that its `from` end feels; 1 by Newton's third law
  double total() const { return spring + damper + extra; }
};

/// An effect on an element (x, v: its travel and rate; positive force pulls `to` toward `from`) or on a mass (x, v: its
/// motion against ground; `extra` pushes it in the direction of growing x). Continuous memory are states z, which start
/// at 0; memory of turning points is kept in members that only `accept` changes, at the end of a step that counts.
class Attachment {
 public:
  virtual ~Attachment() = default;
  virtual int states() const { return 0; }
  virtual void act(double t, double x, double v, const double* z, double* z_rate, Forces& forces) const = 0;
  virtual void accept(double /*t*/, double /*x*/, double /*v*/) {}
};

struct Mount {
  bool on_mass = false;
  Index at = 0;  ///< element or mass
  std::function<std::unique_ptr<Attachment>()> make;
};

/// How far something moved during the record.
struct Extent {
  double least = 0, most = 0, rms = 0, speed_rms = 0;
};

struct Run {
  Matrix outputs;  ///< p x N at the hold rate, the lead included
  std::vector<Extent> elements, masses;
};

struct RunOptions {
  Index lead = 0;      ///< samples before t = 0
  double epoch_s = 0;  ///< added to the time that effects see: what is not tied to the drive differs between records
  double accuracy = 1e-8;  ///< error of a step, relative to the largest value a state has had
};

/// @param felt m x N what the inputs impose, held at the plan's rate. The rate of a displacement input, which only
/// dampers at the input see, is its last jump over the hold interval. Cost: 6 or more evaluations an interval.
/// RigFailure where the motion leaves the laws.
Run run_rig(const Plan& plan, const Vector& theta, const std::vector<Mount>& mounts, const Matrix& felt,
            const RunOptions& options);

}  // namespace wheelhop::blind
