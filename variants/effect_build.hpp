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

/// Adds a law to an element. `values` in the order of the law's parameters; `moved` by their names there.
EffectCandidate with_law(const Plant& plant, std::size_t element, const std::string& effect, const std::string& form,
                         const std::string& law, std::vector<double> values,
                         const std::vector<std::pair<std::string, double>>& moved);

/// Sets parameters of a drive or sensor path, or of the time base, by their full names.
EffectCandidate with_path(const Plant& plant, const std::string& effect, const std::string& location,
                          const std::string& form, const std::vector<EffectParameter>& parameters);

/// True if one node of the element is a displacement input: a tyre, a base mount.
bool at_drive(const Plant& plant, const Element& element);
/// Sum of the element's viscous damping [Ns/m]; 0 for none.
double viscous_damping(const Element& element);
/// Stiffness [N/m] at zero travel; 0 where the element has none.
double stiffness_at_rest(const Element& element);

/// Adds where the literature puts the parameter of that last part of a name ("force_n").
void plausibly(EffectCandidate& candidate, const std::string& parameter, double low, double high);
/// Keeps fits of a yield travel of Bouc and Wen's law from where an element at three times its RMS speed yields faster
/// than their steps follow. To the records such friction is Coulomb's; the derivatives of too long steps grow without
/// end.
void followed_by_steps(EffectCandidate& candidate, const ElementOperation& operation);
/// Adds between what sizes the parameter makes the effect this one: far above it has another name.
void defined_by(EffectCandidate& candidate, const std::string& parameter, double low, double high);
/// Adds the size that the literature gives to a parameter of that last part of a name.
void typically(EffectCandidate& candidate, const std::string& parameter, double value);
/// A third of the size of each moved value, a step that a fit can begin with.
double third(double value);

/// The family of a name and a function.
std::shared_ptr<const Effect> effect_family(
    std::string name, std::function<void(const Plant&, const Operation&, std::vector<EffectCandidate>&)> candidates);

}  // namespace wheelhop
