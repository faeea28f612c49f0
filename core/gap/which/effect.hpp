/// \file
/// Interface of the effect families: what a plant may lack, where it could stand, and how strong it typically is.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "core/greybox/operation.hpp"

namespace wheelhop {

/// Where the literature puts a parameter of an effect: nine of ten lie between.
struct Plausible {
  std::string parameter;
  double low = 0, high = 0;  ///< 0 < low < high, of |value - ideal|
  double ideal = 0;
  bool defining = false;  ///< what lies far above is another effect, however well the equation fits
  /// Standard deviations by which a value's logarithm lies off the middle.
  double deviation(double value) const;
};

/// What a form is called where its sizes are those of another effect.
struct OtherName {
  std::string effect, form;
  std::vector<Plausible> plausible;
};

/// One effect at one place, in one form: the plant with it, ready to be simulated and fitted.
struct EffectCandidate {
  std::string effect;                    ///< id, as the family's name
  std::string location;                  ///< element, mass, "guide:MASS", "actuator", "sensor:CHANNEL" or "timebase"
  std::string form;                      ///< which of the family's forms
  Plant plant;                           ///< the plant asked about, with the effect at a typical size
  std::vector<FitParameter> parameters;  ///< what a fit moves; the first is the strength. None: nothing to fit
  double ideal = 0;                      ///< strength at which the effect vanishes
  bool proportional = true;              ///< small strengths act in proportion; false for a gap or a knee
  bool either_sign = false;              ///< strength may lie on either side of `ideal`
  std::vector<Plausible> plausible = {};
  /// Sizes that the literature gives for a passenger car's corner, where those of `plant` come from the operation at
  /// hand: for judging a test before it is run.
  std::vector<std::pair<std::string, double>> typical = {};
  /// Form with which this one begins: it is fitted from that one's solution where that is an answer, never screened.
  std::string refines = {};
  std::size_t finer_by = 0;                 ///< parameters that it has beyond that form
  std::vector<OtherName> other_names = {};  ///< fitted once, the form is weighed under each of its names
};

/// The candidate, and after it the same under its other names.
std::vector<EffectCandidate> under_all_names(const EffectCandidate& candidate);

/// The candidate at the sizes that the literature gives, where it gives any.
EffectCandidate at_typical_size(EffectCandidate candidate);

/// Log of the log-normal densities of a fitted plant's parameters, each over its largest value: 0 where all lie in the
/// middle of what is plausible, -1.35 for one at an end.
double log_plausibility(const EffectCandidate& candidate, const Plant& fitted);

/// A defining parameter that has left what the effect's name stands for, as "NAME 0.13, usually 0.001 to 0.03", or
/// nothing.
std::string undefined_size(const EffectCandidate& candidate, const Plant& fitted);

/// A family of effects, tolerant of functional form: several candidates a place where forms differ.
class Effect {
 public:
  virtual ~Effect() = default;
  virtual std::string name() const = 0;
  /// Every place of the plant where the effect makes sense; none if there is no such place.
  /// @param operation of the plant under the drives at hand, for sizes to start at
  virtual std::vector<EffectCandidate> candidates(const Plant& plant, const Operation& operation) const = 0;
};

}  // namespace wheelhop
