// Effects that no family of the diagnosis is meant to hold: it should find the place and say that it knows no name.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "experiments/blind/truth/effects.hpp"

namespace wheelhop::blind {
namespace {

constexpr double two_pi = 2 * std::numbers::pi;

/// Force of spring and damper of an element at its usual motion: the scale of what is added.
double usual_force(const Surroundings& rig, Index element) {
  const Extent& motion = rig.elements[static_cast<std::size_t>(element)];
  const BaseLaws laws = base_laws(*rig.plan, rig.theta, element);
  return laws.stiffness_at_rest() * motion.rms + laws.damping * motion.speed_rms;
}

/// A magnet that lets go: negative stiffness about the middle, nothing far from it.
struct MagnetSnap final : Attachment {
  double force = 0, width = 0, middle = 0;
  void act(double, double x, double, const double*, double*, Forces& forces) const override {
    const double r = (x - middle) / width, well = 1 + r * r;
    forces.extra -= 3 * force * r / (well * well);
  }
};

std::optional<Formed> magnet_snap(const Surroundings& rig, const std::string& place, Random& random) {
  const Index e = element_at(*rig.plan, place);
  const double usual = rig.elements[static_cast<std::size_t>(e)].rms, most = usual_force(rig, e);
  MagnetSnap shape;
  shape.width = usual * between(random, 0.2, 0.4);
  shape.middle = usual * between(random, 0.3, 0.8) * either_sign(random);
  return Formed{1e-3 * most, most, [=](double size) {
                  MagnetSnap f = shape;
                  f.force = size;
                  return on_element(e, f, size, "N");
                }};
}

/// A stiffness that something else modulates in time.
struct Modulated final : Attachment {
  double depth = 0, frequency_hz = 0, phase = 0;
  void act(double t, double, double, const double*, double*, Forces& forces) const override {
    forces.spring *= 1 + depth * std::sin(two_pi * frequency_hz * t + phase);
  }
};

std::optional<Formed> modulated(const Surroundings& rig, const std::string& place, Random& random) {
  const Index e = element_at(*rig.plan, place);
  Modulated shape;
  shape.frequency_hz = rig.band_hz * between(random, 0.03, 0.15);
  shape.phase = two_pi * random.uniform();
  return Formed{1e-4, 0.6, [=](double size) {
                  Modulated f = shape;
                  f.depth = size;
                  return on_element(e, f, size, "-");
                }};
}

/// A part of the force is passed on to one end only, the other leaves into a third body.
struct OneWay final : Attachment {
  double share = 0;
  void act(double, double, double, const double*, double*, Forces& forces) const override {
    forces.share_at_from = 1 + share;
  }
};

std::optional<Formed> one_way(const Surroundings& rig, const std::string& place, Random& random) {
  const Index e = element_at(*rig.plan, place);
  const double sign = either_sign(random);
  return Formed{1e-3, 0.8, [=](double size) {
                  OneWay f;
                  f.share = sign * size;
                  return on_element(e, f, sign * size, "-");
                }};
}

/// A spring that only speed brings in: k x v^2 / (v^2 + v_0^2).
struct SpeedSpring final : Attachment {
  double stiffness = 0, speed = 0;
  void act(double, double x, double v, const double*, double*, Forces& forces) const override {
    forces.extra += stiffness * x * v * v / (v * v + speed * speed);
  }
};

std::optional<Formed> speed_spring(const Surroundings& rig, const std::string& place, Random& random) {
  const Index e = element_at(*rig.plan, place);
  const double speed = rig.elements[static_cast<std::size_t>(e)].speed_rms * between(random, 1, 2);
  const double stiffness = base_laws(*rig.plan, rig.theta, e).stiffness_at_rest();
  if (!(speed > 0 && stiffness > 0)) return std::nullopt;
  return Formed{1e-3 * stiffness, 3 * stiffness, [=](double size) {
                  SpeedSpring f;
                  f.stiffness = size;
                  f.speed = speed;
                  return on_element(e, f, size, "N/m");
                }};
}

/// A valve that opens for a while and shuts again, whatever the motion.
struct Leak final : Attachment {
  double loss = 0, period_s = 0, open_share = 0, phase = 0;
  void act(double t, double, double, const double*, double*, Forces& forces) const override {
    const double turn = t / period_s + phase, at = turn - std::floor(turn);
    const double open = 0.5 * (std::tanh(40 * at) - std::tanh(40 * (at - open_share)));
    forces.damper *= 1 - loss * open;
  }
};

std::optional<Formed> leak(const Surroundings& rig, const std::string& place, Random& random) {
  const Index e = element_at(*rig.plan, place);
  Leak shape;
  shape.period_s = between(random, 5, 12);
  shape.open_share = between(random, 0.3, 0.6);
  shape.phase = random.uniform();
  return Formed{1e-3, 0.95, [=](double size) {
                  Leak f = shape;
                  f.loss = size;
                  return on_element(e, f, size, "-");
                }};
}

/// Creep in proportion to the logarithm of time: relaxations at every decade from a tenth of the drive's period on.
struct Creep final : Attachment {
  std::array<double, 5> time = {};
  double stiffness = 0;
  int states() const override { return 5; }
  void act(double, double x, double, const double* z, double* z_rate, Forces& forces) const override {
    for (std::size_t i = 0; i < time.size(); ++i) {
      forces.extra += stiffness * (x - z[i]);
      z_rate[i] = (x - z[i]) / time[i];
    }
  }
};

std::optional<Formed> creep(const Surroundings& rig, const std::string& place, Random& random) {
  const Index e = element_at(*rig.plan, place);
  const double stiffness = base_laws(*rig.plan, rig.theta, e).stiffness_at_rest();
  if (!(stiffness > 0)) return std::nullopt;
  Creep shape;
  const double fastest = between(random, 1, 2) / rig.band_hz;
  for (std::size_t i = 0; i < shape.time.size(); ++i) shape.time[i] = fastest * std::pow(4.0, static_cast<double>(i));
  return Formed{1e-3 * stiffness, stiffness, [=](double size) {
                  Creep f = shape;
                  f.stiffness = size;
                  return on_element(e, f, size, "N/m");
                }};
}

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

std::vector<EffectKind> unknown_kinds() {
  return {{"unknown", "magnet that lets go", struts, magnet_snap},
          {"unknown", "stiffness modulated in time", struts, modulated},
          {"unknown", "force passed on to one end only", struts, one_way},
          {"unknown", "spring that speed brings in", struts, speed_spring},
          {"unknown", "leak that opens and shuts", struts, leak},
          {"unknown", "logarithmic creep", struts, creep},
          {"unknown", "drag in proportion to speed squared", all_masses, drag},
          {"unknown", "loose mass in a cage", all_masses, rattle},
          {"unknown", "contact with a third body", all_masses, third_body},
          {"unknown", "bursts of force", all_masses, bursts},
          {"unknown", "tyre stiffness modulated in time", driven_springs, modulated}};
}

}  // namespace wheelhop::blind
