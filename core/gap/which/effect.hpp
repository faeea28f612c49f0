/// \file
/// Interface of the effect families: what a plant may lack, where it could stand, and how strong it typically is.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/base/place.hpp"
#include "core/greybox/operation.hpp"

namespace wheelhop {

/// Where the literature puts a parameter of an effect: nine of ten lie between.
struct Plausible {
  std::string parameter;
  double low = 0, high = 0;  ///< 0 < low < high, of |value - ideal|
  double ideal = 0;
  bool defining = false;  ///< what lies far above is another effect, however well the equation fits
  double least = 0;       ///< what is smaller counts as this: a gap may be none
  /// Standard deviations by which a value's logarithm lies off the middle.
  double deviation(double value) const;
};

/// Words for a form that bends either way: `below` where the fitted parameter is less than `turns_at`, else `above`.
struct FormWords {
  std::string parameter;
  double turns_at = 0;
  std::string below, above;
};

/// What a model form is called. One form may have several labels: a law that yields is friction where it yields soon,
/// and hysteresis where it yields late. It is fitted once, and its fitted sizes say how well each label suits it.
struct Label {
  EffectId effect;                        ///< the family
  std::string form;                       ///< the form, in words of that effect; with `words` one that names both
  std::vector<Plausible> plausible = {};  ///< sizes that go by this label
  std::optional<FormWords> words = {};
};

/// The form of a label in words: of a form that bends either way, how it does in the fitted plant.
std::string form_of(const Label& label, const Plant& fitted);

/// A plant that a model form was applied to.
struct Applied {
  Plant plant;
  /// "ELEMENT.LAW" of the law that the form adds, or "ELEMENT.LAW[2]" beside another one of its kind: what the names of
  /// its parameters begin with. Empty where those are the same in every plant.
  std::string law = {};
};

/// A model form as an operation on a plant. None where the plant lacks the place, or what the form corrects, or has the
/// part already that the form adds (a mass, a load, a path between sensors). A law is added beside one of its kind, and
/// a number of a path is set once more. A form that would do nothing is not refused: a catalogue does not offer it.
using ModelForm = std::function<std::optional<Applied>(const Plant&)>;

/// One model form at one place: the plant with it, ready to be simulated and fitted.
struct EffectCandidate {
  std::vector<Label> labels;  ///< one or more; the first one is that of the family which offers the form
  Place location;
  Plant plant;                           ///< the plant asked about, with the effect at a typical size
  std::vector<FitParameter> parameters;  ///< what a fit moves; the first is the strength. None: nothing to fit
  double ideal = 0;                      ///< strength at which the effect vanishes
  bool proportional = true;              ///< small strengths act in proportion; false for a gap or a knee
  bool either_sign = false;              ///< strength may lie on either side of `ideal`
  /// Sizes that the literature gives for a passenger car's corner, where those of `plant` come from the operation at
  /// hand: for judging a test before it is run.
  std::vector<std::pair<std::string, double>> typical = {};
  /// Form with which this one begins: it is fitted from that one's solution where that is an answer, never screened.
  std::string refines = {};
  std::size_t finer_by = 0;  ///< parameters that it has beyond that form
  ModelForm apply = {};      ///< how `plant` was made, for in_plant()
  std::string law = {};      ///< Applied::law in `plant`
  const Label& label() const { return labels.front(); }
};

/// The candidate in another plant, with the sizes at which it was offered; what corrects a damper has that plant's
/// damping. None as of its form. std::invalid_argument if it has no `apply`.
std::optional<EffectCandidate> in_plant(const EffectCandidate& candidate, const Plant& plant);

/// What a candidate is called by its first label.
EffectAt name_of(const EffectCandidate& candidate);
/// The same by any of its labels.
EffectAt name_of(const EffectCandidate& candidate, const Label& label);

/// True if two candidates are one model form at one place: they share a label. The sizes they start at may differ.
bool same_form(const EffectCandidate& a, const EffectCandidate& b);

/// All ways to name a set of effects: for each effect the index of one of its labels, so that no two effects have the
/// same name (effect and location). The one that takes every first label comes first, if it is allowed. Empty if there
/// is none.
std::vector<std::vector<std::size_t>> labellings(const std::vector<EffectCandidate>& effects);

/// The candidate at the sizes that the literature gives, where it gives any.
EffectCandidate at_typical_size(EffectCandidate candidate);

/// Log of the log-normal densities of a fitted plant's parameters under a label, each over its largest value: 0 where
/// all lie in the middle of what is plausible, -1.35 for one at an end.
double log_plausibility(const Label& label, const Plant& fitted);

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
