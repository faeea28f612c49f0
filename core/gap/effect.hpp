/// \file
/// Interface of the effect families: what a plant may lack, where it could stand, and how strong it typically is.
#pragma once

#include <string>
#include <vector>

#include "core/gap/plant_fit.hpp"

namespace wheelhop {

/// One effect at one place, in one form: the plant with it, ready to be simulated and fitted.
struct EffectCandidate {
  std::string effect;                    ///< id, as the family's name
  std::string location;                  ///< element, mass, "actuator", "sensor:CHANNEL" or "timebase"
  std::string form;                      ///< which of the family's forms
  Plant plant;                           ///< the plant asked about, with the effect at a typical size
  std::vector<FitParameter> parameters;  ///< what a fit moves; the first is the strength
  double ideal = 0;                      ///< strength at which the effect vanishes
  bool proportional = true;              ///< small strengths act in proportion; false for a gap or a knee
  bool either_sign = false;              ///< strength may lie on either side of `ideal`
};

/// A family of effects, tolerant of functional form: several candidates a place where forms differ.
class Effect {
 public:
  virtual ~Effect() = default;
  virtual std::string name() const = 0;
  /// Every place of the plant where the effect makes sense; none if there is no such place.
  virtual std::vector<EffectCandidate> candidates(const Plant& plant) const = 0;
};

}  // namespace wheelhop
