// Effects on masses that no family of the diagnosis is meant to hold.
#include <algorithm>
#include <cmath>

#include "experiments/rig/effects.hpp"

namespace wheelhop::blind {
namespace {

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

}  // namespace

std::vector<EffectKind> unknown_mass_kinds() { return {{"unknown", "loose mass in a cage", all_masses, rattle}}; }

}  // namespace wheelhop::blind
