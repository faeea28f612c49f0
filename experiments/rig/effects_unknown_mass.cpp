// Effects on masses that no family of the diagnosis is meant to hold.
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

/// A loose mass in a cage: free inside the clearance, damped elastic impacts at its ends.
struct Rattle final : Attachment {
  double mass = 0, gap = 0, stiffness = 0, damping = 0;
  int states() const override { return 2; }
  void act(double, double x, double v, const double* z, double* z_rate, Forces& forces) const override {
    const double apart = z[0] - x, depth = apart - std::clamp(apart, -gap, gap);
    // Impacts push only: the damping alone would hold the mass back as it leaves.
    const double push = stiffness * depth + (depth != 0 ? damping * (z[1] - v) : 0);
    const double force = push * depth > 0 ? push : 0;
    forces.extra += force;
    z_rate[0] = z[1];
    z_rate[1] = -force / mass;
  }
};

std::optional<Formed> rattle(const Surroundings& rig, const std::string& place, Random& random) {
  const Index i = mass_at(*rig.plan, place);
  const double gap = rig.masses[static_cast<std::size_t>(i)].rms * between(random, 0.1, 0.4);
  const double w = two_pi * rig.band_hz * between(random, 2, 4), ratio = between(random, 0.05, 0.2);
  return Formed{1e-4 * rig.theta(i), 0.4 * rig.theta(i), [=](double size) {
                  Rattle f;
                  f.mass = size;
                  f.gap = gap;
                  f.stiffness = size * w * w;
                  f.damping = 2 * ratio * w * size;
                  return on_mass(i, f, size, "kg");
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

}  // namespace

std::vector<EffectKind> unknown_mass_kinds() {
  return {{"unknown", "drag in proportion to speed squared", all_masses, drag},
          {"unknown", "loose mass in a cage", all_masses, rattle},
          {"unknown", "contact with a third body", all_masses, third_body}};
}

}  // namespace wheelhop::blind
