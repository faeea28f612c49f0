// Laws between a mass and the ground, where the plant has no element: a diagnosis has names for them, but for drag on
// what a tyre carries, where damping against the ground goes by the tyre's name.
#include <algorithm>
#include <cmath>

#include "experiments/rig/effects.hpp"

namespace wheelhop::blind {
namespace {

/// Drag of the air: c v |v| against ground.
struct Drag final : Attachment {
  double factor = 0;
  void act(double, double, double v, const double*, double*, Forces& forces) const override {
    forces.extra -= factor * v * std::abs(v);
  }
};

std::optional<Formed> drag(const Surroundings& rig, const std::string& place, Random&) {
  const Index i = mass_at(*rig.plan, place);
  const double speed = rig.masses[static_cast<std::size_t>(i)].speed_rms;
  if (!(speed > 0)) return std::nullopt;
  // Up to the momentum of the mass lost over a few of its own usual strokes.
  const double most = rig.theta(i) * rig.band_hz / speed;
  return Formed{1e-5 * most, most, [=](double size) {
                  Drag f;
                  f.factor = size;
                  return on_mass(i, f, size, "Ns^2/m^2");
                }};
}

/// A third body that stands by: touched from one side, from time to time, when the motion reaches so far.
struct ThirdBody final : Attachment {
  double side = 1, reach = 0, stiffness = 0, time = 0;
  void act(double, double x, double v, const double*, double*, Forces& forces) const override {
    const double depth = side * x - reach;
    if (depth > 0) forces.extra -= side * stiffness * std::max(0.0, depth * (1 + time * side * v / (depth + 1e-4)));
  }
};

std::optional<Formed> third_body(const Surroundings& rig, const std::string& place, Random& random) {
  const Index i = mass_at(*rig.plan, place);
  const Extent& motion = rig.masses[static_cast<std::size_t>(i)];
  ThirdBody shape;
  shape.side = either_sign(random);
  shape.reach = (shape.side > 0 ? motion.most : -motion.least) * between(random, 0.4, 0.6);
  shape.time = between(random, 0.05, 0.15) / rig.band_hz;
  const double scale = rig.theta(i) * std::pow(motion.speed_rms / motion.rms, 2);
  return Formed{1e-3 * scale, 10 * scale, [=](double size) {
                  ThirdBody f = shape;
                  f.stiffness = size;
                  return on_mass(i, f, size, "N/m");
                }};
}

/// Masses at a driven spring.
std::vector<std::string> carried_masses(const Plan& plan) {
  std::vector<std::string> names;
  for (const std::string& mass : all_masses(plan)) {
    const Index i = mass_at(plan, mass);
    if (std::any_of(plan.elements.begin(), plan.elements.end(), [&](const PlanElement& element) {
          return plan.at_drive(element) && (element.from == i || element.to == i);
        }))
      names.push_back(mass);
  }
  return names;
}

/// Guides of all other masses.
std::vector<std::string> guides_above(const Plan& plan) {
  std::vector<std::string> names = guides(plan);
  for (const std::string& mass : carried_masses(plan))
    std::erase_if(names, [&](const std::string& name) { return mass_at(plan, name) == mass_at(plan, mass); });
  return names;
}

}  // namespace

std::vector<EffectKind> unknown_ground_kinds() {
  return {{"unknown", "drag in proportion to speed squared", carried_masses, drag}};
}

std::vector<EffectKind> added_ground_kinds() {
  return {{"damper_nonlinearity", "drag of the air on a mass", guides_above, drag},
          {"bump_stop", "contact with a third body", guides, third_body}};
}

}  // namespace wheelhop::blind
