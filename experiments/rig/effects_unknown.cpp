// Effects of elements that no family of the diagnosis is meant to hold: it should find the place and say that it knows
// no name.
#include <algorithm>
#include <array>
#include <cmath>

#include "experiments/rig/effects.hpp"

namespace wheelhop::blind {
namespace {

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
  const double usual = motion_of(rig, e).rms, most = usual_force(rig, e);
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
  const double speed = motion_of(rig, e).speed_rms * between(random, 1, 2);
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

}  // namespace

std::vector<EffectKind> unknown_strut_kinds() {
  return {{"unknown", "magnet that lets go", struts, magnet_snap},
          {"unknown", "stiffness modulated in time", struts, modulated},
          {"unknown", "force passed on to one end only", struts, one_way},
          {"unknown", "spring that speed brings in", struts, speed_spring},
          {"unknown", "leak that opens and shuts", struts, leak},
          {"unknown", "logarithmic creep", struts, creep},
          {"unknown", "tyre stiffness modulated in time", driven_springs, modulated}};
}

}  // namespace wheelhop::blind
