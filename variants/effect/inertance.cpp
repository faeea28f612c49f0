#include <algorithm>

#include "core/plant/motion.hpp"
#include "variants/effect/effects.hpp"

namespace wheelhop {
namespace {

constexpr double kOfReduced = 0.1;  // of the mass that an element's travel moves, what an inerter starts with

/// The mass that a force between the nodes of an element feels: 1 / (g' M^-1 g), g what its travel is made of.
double reduced_mass(const Plant& plant, const Element& element) {
  const Motion motion(plant);
  Vector g = Vector::Zero(plant.mass_count());
  for (const Motion::Weight& weight : motion.weights(plant.node(element.to))) g(weight.mass) += weight.value;
  for (const Motion::Weight& weight : motion.weights(plant.node(element.from))) g(weight.mass) -= weight.value;
  const double inverse = g.dot(motion.inverse_mass_matrix() * g);
  return inverse > 0 ? 1 / inverse : 0;
}

}  // namespace

// Fluid that a hydraulic mount moves to and fro, a flywheel on a screw: a mass that only relative motion accelerates.
// Between the ground and a mass it is a part of that mass, and a held drive has no acceleration.
std::shared_ptr<const Effect> make_inertance(const EffectOptions&) {
  return effect_family("inertance", [](const Plant& plant, const Operation&, std::vector<EffectCandidate>& list) {
    for (std::size_t e = 0; e < plant.elements.size(); ++e) {
      const Element& element = plant.elements[e];
      const auto known = [](const Law& law) { return law.kind->role == LawRole::inertance; };
      if (at_drive(plant, element) || element.from == "ground" || element.to == "ground" ||
          std::any_of(element.laws.begin(), element.laws.end(), known))
        continue;
      const double inertance = kOfReduced * reduced_mass(plant, element);
      if (!(inertance > 0)) continue;
      list.push_back(
          with_law(plant, e, "inertance", "inerter", "inerter", {inertance}, {{"inertance_kg", third(inertance)}}));
    }
  });
}

}  // namespace wheelhop
