// Effects on masses.
#include <cmath>
#include <numbers>

#include "experiments/blind/truth/effects.hpp"

namespace wheelhop::blind {
namespace {

/// A small mass on a spring and damper of its own.
struct Resonator final : Attachment {
  double mass = 0, stiffness = 0, damping = 0;
  int states() const override { return 2; }
  void act(double, double x, double v, const double* z, double* z_rate, Forces& forces) const override {
    const double pull = stiffness * (z[0] - x) + damping * (z[1] - v);
    forces.extra += pull;
    z_rate[0] = z[1];
    z_rate[1] = -pull / mass;
  }
};

std::optional<Formed> resonator(const Surroundings& rig, const std::string& place, Random& random) {
  const Index i = mass_at(*rig.plan, place);
  const double w = 2 * std::numbers::pi * rig.band_hz * between(random, 0.25, 0.6), ratio = between(random, 0.03, 0.1);
  const double host = rig.theta(i);
  return Formed{1e-4 * host, 0.4 * host, [=](double size) {
                  Resonator f;
                  f.mass = size;
                  f.stiffness = size * w * w;
                  f.damping = 2 * ratio * w * size;
                  return on_mass(i, f, size, "kg");
                }};
}

/// A force of its own spectrum that goes on whatever the drive does.
struct Exogenous final : Attachment {
  Command lines;
  void act(double t, double, double, const double*, double*, Forces& forces) const override {
    for (const Cosine& c : lines)
      forces.extra += c.amplitude * std::cos(2 * std::numbers::pi * c.frequency_hz * t + c.phase);
  }
};

std::optional<Formed> exogenous(const Surroundings& rig, const std::string& place, Random& random) {
  const Index i = mass_at(*rig.plan, place);
  const double from = rig.band_hz * between(random, 0.03, 0.1), to = rig.band_hz * between(random, 0.3, 0.6);
  Exogenous shape;
  constexpr int lines = 24;
  for (int k = 0; k < lines; ++k)
    shape.lines.push_back({std::sqrt(2.0 / lines), from + (to - from) * (k + random.uniform()) / lines,
                           2 * std::numbers::pi * random.uniform()});
  const double speed = rig.masses[static_cast<std::size_t>(i)].speed_rms;
  const double usual = rig.theta(i) * speed * 2 * std::numbers::pi * from;
  return Formed{1e-3 * usual, 3 * usual, [=](double size) {
                  Exogenous f = shape;
                  for (Cosine& c : f.lines) c.amplitude *= size;
                  return on_mass(i, f, size, "N");
                }};
}

}  // namespace

std::vector<EffectKind> mass_kinds() {
  return {{"added_mode", "small mass, spring and damper", all_masses, resonator},
          {"exogenous_force", "band-limited force", all_masses, exogenous}};
}

}  // namespace wheelhop::blind
