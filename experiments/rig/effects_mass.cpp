// Effects on masses.
#include <array>
#include <cmath>

#include "experiments/rig/effects.hpp"

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
  const double w = two_pi * rig.band_hz * between(random, 0.25, 0.6), ratio = between(random, 0.03, 0.1);
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
    for (const Cosine& c : lines) forces.extra += c.amplitude * std::cos(two_pi * c.frequency_hz * t + c.phase);
  }
};

std::optional<Formed> exogenous(const Surroundings& rig, const std::string& place, Random& random) {
  const Index i = mass_at(*rig.plan, place);
  const double from = rig.band_hz * between(random, 0.03, 0.1), to = rig.band_hz * between(random, 0.3, 0.6);
  Exogenous shape;
  constexpr int lines = 24;
  for (int k = 0; k < lines; ++k)
    shape.lines.push_back(
        {std::sqrt(2.0 / lines), from + (to - from) * (k + random.uniform()) / lines, two_pi * random.uniform()});
  const double speed = rig.masses[static_cast<std::size_t>(i)].speed_rms;
  const double usual = rig.theta(i) * speed * two_pi * from;
  return Formed{1e-3 * usual, 3 * usual, [=](double size) {
                  Exogenous f = shape;
                  for (Cosine& c : f.lines) c.amplitude *= size;
                  return on_mass(i, f, size, "N");
                }};
}

/// Bursts of force at irregular times.
struct Bursts final : Attachment {
  double force = 0, every_s = 0, frequency_hz = 0, width_s = 0;
  std::array<double, 16> jitter = {};
  void act(double t, double, double, const double*, double*, Forces& forces) const override {
    const double turn = std::floor(t / every_s);
    const auto k = static_cast<std::size_t>(static_cast<long long>(turn) & 15);
    const double from_middle = t - (turn + 0.3 + 0.4 * jitter[k]) * every_s, r = from_middle / width_s;
    if (std::abs(r) < 5)
      forces.extra += force * std::exp(-0.5 * r * r) * std::sin(two_pi * frequency_hz * from_middle + 6 * jitter[k]);
  }
};

std::optional<Formed> bursts(const Surroundings& rig, const std::string& place, Random& random) {
  const Index i = mass_at(*rig.plan, place);
  Bursts shape;
  shape.every_s = between(random, 2, 5);
  shape.frequency_hz = rig.band_hz * between(random, 0.1, 0.4);
  shape.width_s = between(random, 1, 2) / shape.frequency_hz;
  for (double& value : shape.jitter) value = random.uniform();
  const double usual = rig.theta(i) * rig.masses[static_cast<std::size_t>(i)].speed_rms * two_pi * shape.frequency_hz;
  return Formed{1e-3 * usual, 10 * usual, [=](double size) {
                  Bursts f = shape;
                  f.force = size;
                  return on_mass(i, f, size, "N");
                }};
}

}  // namespace

std::vector<EffectKind> mass_kinds() {
  return {{"added_mode", "small mass, spring and damper", all_masses, resonator},
          {"exogenous_force", "band-limited force", all_masses, exogenous},
          {"exogenous_force", "bursts of force", all_masses, bursts}};
}

}  // namespace wheelhop::blind
