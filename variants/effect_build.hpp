/// \file
/// What the effect families share: putting a law or a path parameter into a plant and saying what a fit may move.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/gap/which/effect.hpp"

namespace wheelhop {

/// A family takes no options: sizes are those of the literature, and forms are all tried.
struct EffectOptions {
  template <class V>
  void fields(V&&) {}
};

/// A parameter of the effect: its typical value and how far a fit moves it at first.
struct EffectParameter {
  std::string name;
  double value = 0;
  double scale = 1;
};

/// A place at which a law may stand between two nodes of a plant: an element, or the guide between the ground and a
/// mass that no other element joins to it.
struct LawPlace {
  std::size_t element = 0;     ///< of the plant; the number of its elements for a guide that is none of them yet
  std::string mass = {};       ///< guided mass; empty for an element of the plant itself
  ElementOperation operation;  ///< of the element, or of the mass
  bool guide() const { return !mass.empty(); }
};

/// All elements of a plant, then the guides of its masses. A mass that turns has none: what slides on a guide there
/// would be a moment.
std::vector<LawPlace> law_places(const Plant& plant, const Operation& operation);

/// Adds a law to an element. `values` in the order of the law's parameters, of which the last ones may be left to their
/// fallbacks; `moved` by their names there, the strength first. Beside a law that follows a drive (`Schedule`) the
/// strength may follow it too, and what corrects a damper follows it as the damper does.
EffectCandidate with_law(const Plant& plant, std::size_t element, const EffectId& effect, const std::string& form,
                         const std::string& law, std::vector<double> values,
                         const std::vector<std::pair<std::string, double>>& moved);
/// The same at a place; a guide becomes an element of the candidate's plant.
EffectCandidate with_law(const Plant& plant, const LawPlace& place, const EffectId& effect, const std::string& form,
                         const std::string& law, std::vector<double> values,
                         const std::vector<std::pair<std::string, double>>& moved);

/// What a form adds to a plant before it sets parameters; false where the plant lacks the place or has that already.
using Addition = std::function<bool(Plant&)>;
/// Sets parameters of a drive or sensor path, of the time base, or of what `addition` adds, by their full names.
EffectCandidate with_path(const Plant& plant, const EffectId& effect, const Place& location, const std::string& form,
                          const std::vector<EffectParameter>& parameters, Addition addition = {});

/// True if one node of the element is a displacement input and the other one moves: a tyre, a base mount; but not a
/// damper on a dynamometer.
bool at_drive(const Plant& plant, const Element& element);
/// True of such an element that carries what a tyre does: its mass hangs on another mass or rigid point by an element
/// less than half as stiff. A mount between a shaking table and a crate is none, and a storey above it neither.
bool is_tyre(const Plant& plant, const Element& element);
/// True of a tyre, and of the guide of a mass at the end of one. Damping there goes by the name of the tyre's.
bool at_tyre(const Plant& plant, const LawPlace& place);
/// Sum of the element's viscous damping [Ns/m] as delivered; 0 for none, and for a guide, where only an effect puts
/// any.
double viscous_damping(const Element& element);
/// True if the element has a damper of its own, of which all other damper laws are corrections.
bool has_damper(const Element& element);
/// Stiffness [N/m] at zero travel; 0 where the element has none.
double stiffness_at_rest(const Element& element);

/// Travel of sliding friction before it slides [m]: metal slides after 10 to 100 micrometres (B. Armstrong-Helouvry et
/// al. 1994, Automatica 30(7)), a seal after up to a millimetre.
inline constexpr double kLeastPresliding = 2e-5, kMostPresliding = 1e-3;
/// Yield travel of bushings and struts with hysteresis [m]: a judgement.
inline constexpr double kLeastYield = 2e-4, kMostYield = 5e-3;

/// Bouc and Wen's law in its plain form at a place: a force that is reached after an elastic travel. It has two labels,
/// as the yield travel is that of presliding or of a deforming bushing: "presliding" of coulomb_friction and "Bouc-Wen"
/// of hysteresis.
/// @param first the effect whose label comes first   @param force [N]   @param yield travel [m] to start at
EffectCandidate with_yielding(const Plant& plant, const LawPlace& place, const EffectId& first, double force,
                              double yield);

/// Gives the candidate one more label. Later calls of `plausibly` and `defined_by` are about this one.
void also_called(EffectCandidate& candidate, const EffectId& effect, const std::string& form);
/// Sets the form of the last label to "BELOW or ABOVE", and the words that tell them apart by the fitted value of a
/// parameter. @param parameter the last part of its name
void bends(EffectCandidate& candidate, const std::string& parameter, double turns_at, const std::string& below,
           const std::string& above);
/// Adds where the literature puts the parameter of that last part of a name ("force_n"), under the last label.
void plausibly(EffectCandidate& candidate, const std::string& parameter, double low, double high);
/// Keeps fits of a yield travel of Bouc and Wen's law from where an element at three times its RMS speed yields faster
/// than their steps follow. To the records such friction is Coulomb's; the derivatives of too long steps grow without
/// end.
void followed_by_steps(EffectCandidate& candidate, const ElementOperation& operation);
/// Keeps a first fit of the speed over which a sign is smoothed from where the law is a step to the records, and tells
/// nothing of how to go on: a tenth of the size that it starts at.
void smoothed_at_first(EffectCandidate& candidate);
/// Adds between what sizes the parameter makes the effect that of the last label: far above it has another name.
void defined_by(EffectCandidate& candidate, const std::string& parameter, double low, double high);
/// Adds the size that the literature gives to a parameter of that last part of a name, of a passenger car's corner.
void typically(EffectCandidate& candidate, const std::string& parameter, double value);
/// Offset of a sensor that the literature gives, in its unit; 0 of a force, where it goes with the measuring range.
double usual_offset(const Sensor& sensor);
/// A third of the size of each moved value, a step that a fit can begin with.
double third(double value);

/// The family of a name and a function.
std::shared_ptr<const Effect> effect_family(
    std::string name, std::function<void(const Plant&, const Operation&, std::vector<EffectCandidate>&)> candidates);

}  // namespace wheelhop
