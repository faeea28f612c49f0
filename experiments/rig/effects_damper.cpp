// Effects of dampers.
#include <algorithm>
#include <cmath>

#include "experiments/rig/effects.hpp"

namespace wheelhop::blind {
namespace {

/// Valves of rebound and jounce that hand over smoothly about standstill.
struct TwoValves final : Attachment {
  double asymmetry = 0, transition = 0;
  void act(double, double, double v, const double*, double*, Forces& forces) const override {
    forces.damper *= 1 + asymmetry * std::tanh(v / transition);
  }
};

std::optional<Formed> asymmetry(const Surroundings& rig, const std::string& place, Random& random) {
  const Index e = element_at(*rig.plan, place);
  const double speed = motion_of(rig, e).speed_rms, sign = either_sign(random);
  if (speed == 0) return std::nullopt;
  const double transition = speed * between(random, 0.15, 0.4);
  return Formed{1e-3, 0.85, [=](double size) {
                  TwoValves f;
                  f.asymmetry = sign * size;
                  f.transition = transition;
                  return on_element(e, f, sign * size, "-");
                }};
}

/// A measured curve as a table of straight pieces: from the first knee the slope falls, beyond the second (blow-off) it
/// falls further.
struct BlowOff final : Attachment {
  double first = 0, second = 0, loss = 0;
  void act(double, double, double v, const double*, double*, Forces& forces) const override {
    const double speed = std::abs(v);
    const double lost =
        0.5 * loss * std::max(0.0, std::min(speed, second) - first) + loss * std::max(0.0, speed - second);
    forces.damper -= forces.base->damping * std::copysign(lost, v);
  }
};

std::optional<Formed> blow_off(const Surroundings& rig, const std::string& place, Random& random) {
  const Index e = element_at(*rig.plan, place);
  const double speed = motion_of(rig, e).speed_rms;
  if (speed == 0) return std::nullopt;
  BlowOff shape;
  shape.first = speed * between(random, 0.3, 0.6);
  shape.second = speed * between(random, 0.9, 1.5);
  return Formed{1e-3, 0.95, [=](double size) {
                  BlowOff f = shape;
                  f.loss = size;
                  return on_element(e, f, size, "-");
                }};
}

/// Damping that decays exponentially with the heat in oil and tube; the heat leaves by first order.
struct ThermalFade final : Attachment {
  double per_joule = 0, cooling = 0;
  int states() const override { return 1; }
  void act(double, double, double v, const double* z, double* z_rate, Forces& forces) const override {
    forces.damper *= std::exp(-per_joule * std::max(z[0], 0.0));
    z_rate[0] = forces.damper * v - z[0] / cooling;
  }
};

std::optional<Formed> fade(const Surroundings& rig, const std::string& place, Random& random) {
  const Index e = element_at(*rig.plan, place);
  const double speed = motion_of(rig, e).speed_rms;
  const double power = base_laws(*rig.plan, rig.theta, e).damping * speed * speed;
  if (power == 0) return std::nullopt;
  const double cooling = rig.duration_s * between(random, 1.5, 6);
  const double heat = power * rig.duration_s;  // of a record without losses
  return Formed{1e-3 / heat, 2 / heat, [=](double size) {
                  ThermalFade f;
                  f.per_joule = size;
                  f.cooling = cooling;
                  return on_element(e, f, size, "1/J");
                }};
}

/// Air in the damper: after each reversal into the weak side the force is missing over a dead travel and then comes
/// back over a fifth of it.
struct DeadTravel final : Attachment {
  double side = 1, travel = 0;
  double turned_at = 0;  ///< s x where the weak side's stroke began
  void act(double, double x, double v, const double*, double*, Forces& forces) const override {
    if (side * v <= 0) return;
    const double s = std::clamp((side * x - turned_at - travel) / (0.2 * travel), 0.0, 1.0);
    forces.damper *= s * s * (3 - 2 * s);
  }
  void accept(double, double x, double v) override {
    if (side * v <= 0 || side * x < turned_at) turned_at = side * x;
  }
};

std::optional<Formed> cavitation(const Surroundings& rig, const std::string& place, Random& random) {
  const Index e = element_at(*rig.plan, place);
  const double usual = motion_of(rig, e).rms, side = either_sign(random);
  if (usual == 0) return std::nullopt;
  return Formed{1e-3 * usual, 1.5 * usual, [=](double size) {
                  DeadTravel f;
                  f.side = side;
                  f.travel = size;
                  return on_element(e, f, size, "m");
                }};
}

}  // namespace

std::vector<EffectKind> damper_kinds() {
  return {{"damper_asymmetry", "two valves, smooth transition", struts, asymmetry},
          {"damper_nonlinearity", "table of straight pieces with blow-off", struts, blow_off},
          {"damper_fade", "exponential in the heat stored", struts, fade},
          {"cavitation", "dead travel after reversal", struts, cavitation}};
}

}  // namespace wheelhop::blind
