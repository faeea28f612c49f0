// Effects of elements in the formulas of textbooks: a second form beside that of the other files, at times the
// catalogue's own.
#include <algorithm>
#include <cmath>

#include "experiments/rig/effects.hpp"

namespace wheelhop::blind {
namespace {

/// Dry friction with a smoothed sign.
struct DryFriction final : Attachment {
  double force = 0, width = 0;
  void act(double, double, double v, const double*, double*, Forces& forces) const override {
    forces.extra += force * std::tanh(v / width);
  }
};

std::optional<Formed> dry_friction(const Surroundings& rig, const std::string& place, Random& random) {
  const Index e = element_at(*rig.plan, place);
  const double speed = motion_of(rig, e).speed_rms, usual = usual_force(rig, e);
  if (speed == 0) return std::nullopt;
  const double width = speed * between(random, 0.02, 0.08);
  return Formed{1e-4 * usual, 2 * usual, [=](double size) {
                  DryFriction f;
                  f.force = size;
                  f.width = width;
                  return on_element(e, f, size, "N");
                }};
}

/// Bouc 1967 and Wen 1976 with an exponent of two: the knee of the loop is sharper than that of one slider.
struct BoucWen final : Attachment {
  double force = 0, yield = 0, beta = 0;
  int states() const override { return 1; }
  void act(double, double, double v, const double* z, double* z_rate, Forces& forces) const override {
    z_rate[0] = (v - (beta * std::abs(v) * z[0] + (1 - beta) * v * std::abs(z[0])) * std::abs(z[0])) / yield;
    forces.extra += force * z[0];
  }
};

std::optional<Formed> bouc_wen(const Surroundings& rig, const std::string& place, Random& random) {
  const Index e = element_at(*rig.plan, place);
  const double usual = usual_force(rig, e);
  BoucWen shape;
  shape.yield = motion_of(rig, e).rms * between(random, 0.15, 0.5);
  shape.beta = between(random, 0.4, 0.7);
  if (usual == 0) return std::nullopt;
  return Formed{1e-4 * usual, 2 * usual, [=](double size) {
                  BoucWen f = shape;
                  f.force = size;
                  return on_element(e, f, size, "N");
                }};
}

/// The damper stands behind the rubber of its mount: z is the piston's travel, the mount takes the rest.
struct MountedDamper final : Attachment {
  double softness = 0;  ///< m/N
  int states() const override { return 1; }
  void act(double, double x, double v, const double* z, double* z_rate, Forces& forces) const override {
    const double damping = forces.base->damping;
    const double force = (x - z[0]) / softness;
    z_rate[0] = force / damping;
    forces.damper += force - damping * v;
  }
};

std::optional<Formed> damper_mount(const Surroundings& rig, const std::string& place, Random&) {
  const Index e = element_at(*rig.plan, place);
  const double damping = base_laws(*rig.plan, rig.theta, e).damping;
  if (!(damping > 0)) return std::nullopt;
  // A relaxation of half a millisecond to thirty.
  return Formed{5e-4 / damping, 0.03 / damping, [=](double size) {
                  MountedDamper f;
                  f.softness = size;
                  return on_element(e, f, 1 / size, "N/m");
                }};
}

/// A power of the depth beyond a gap, on both sides.
struct PowerStops final : Attachment {
  double gap = 0, exponent = 1, factor = 0;
  void act(double, double x, double, const double*, double*, Forces& forces) const override {
    const double depth = std::abs(x) - gap;
    if (depth > 0) forces.extra += std::copysign(factor * std::pow(depth, exponent), x);
  }
};

std::optional<Formed> power_stops(const Surroundings& rig, const std::string& place, Random& random) {
  const Index e = element_at(*rig.plan, place);
  const Extent& motion = motion_of(rig, e);
  const double reach = std::max(motion.most, -motion.least);
  if (!(reach > 0)) return std::nullopt;
  PowerStops shape;
  shape.gap = reach * between(random, 0.45, 0.7);
  shape.exponent = between(random, 1.2, 2.5);
  const double force = base_laws(*rig.plan, rig.theta, e).stiffness_at_rest() * reach;
  return Formed{1e-3 * force, 10 * force, [=](double size) {
                  PowerStops f = shape;
                  f.factor = size / std::pow(reach - shape.gap, shape.exponent);
                  return on_element(e, f, size, "N");
                }};
}

/// Nothing is felt inside the clearance, the whole spring outside.
struct DeadBand final : Attachment {
  double half = 0;
  void act(double, double x, double, const double*, double*, Forces& forces) const override {
    forces.spring = forces.base->spring(x > half ? x - half : x < -half ? x + half : 0);
  }
};

std::optional<Formed> dead_band(const Surroundings& rig, const std::string& place, Random&) {
  const Index e = element_at(*rig.plan, place);
  const double usual = motion_of(rig, e).rms;
  if (usual == 0) return std::nullopt;
  return Formed{1e-4 * usual, 0.7 * usual, [=](double size) {
                  DeadBand f;
                  f.half = size;
                  return on_element(e, f, size, "m");
                }};
}

/// A spring that hardens as a hyperbolic sine, or softens as a hyperbolic tangent does, by a length.
struct CurvedSpring final : Attachment {
  double stiffness = 0, length = 0;
  bool hardens = true;
  void act(double, double x, double, const double*, double*, Forces& forces) const override {
    const double bent = hardens ? std::sinh(x / length) : std::tanh(x / length);
    forces.extra += stiffness * (length * bent - x);
  }
};

std::optional<Formed> curved_spring(const Surroundings& rig, const std::string& place, Random& random) {
  const Index e = element_at(*rig.plan, place);
  const double usual = motion_of(rig, e).rms, stiffness = base_laws(*rig.plan, rig.theta, e).stiffness_at_rest();
  if (usual == 0 || !(stiffness > 0)) return std::nullopt;
  const bool hardens = random.uniform() < 0.5;
  return Formed{0.02, 2, [=](double size) {
                  CurvedSpring f;
                  f.stiffness = stiffness;
                  f.length = usual / size;
                  f.hardens = hardens;
                  return on_element(e, f, f.length, "m");
                }};
}

/// d v (1 + a sgn v).
struct TwoSlopes final : Attachment {
  double asymmetry = 0;
  void act(double, double, double v, const double*, double*, Forces& forces) const override {
    forces.damper *= v > 0 ? 1 + asymmetry : 1 - asymmetry;
  }
};

std::optional<Formed> two_slopes(const Surroundings& rig, const std::string& place, Random& random) {
  const Index e = element_at(*rig.plan, place);
  const double sign = either_sign(random);
  return Formed{1e-3, 0.85, [=](double size) {
                  TwoSlopes f;
                  f.asymmetry = sign * size;
                  return on_element(e, f, sign * size, "-");
                }};
}

/// F_m tanh(d v / F_m).
struct SaturatedDamper final : Attachment {
  double most = 0;
  void act(double, double, double, const double*, double*, Forces& forces) const override {
    forces.damper = most * std::tanh(forces.damper / most);
  }
};

std::optional<Formed> saturated_damper(const Surroundings& rig, const std::string& place, Random&) {
  const Index e = element_at(*rig.plan, place);
  const double usual = base_laws(*rig.plan, rig.theta, e).damping * motion_of(rig, e).speed_rms;
  if (!(usual > 0)) return std::nullopt;
  return Formed{0.02, 3, [=](double size) {
                  SaturatedDamper f;
                  f.most = usual / size;
                  return on_element(e, f, f.most, "N");
                }};
}

/// d v (1 + b |v|): oil that an orifice lets through.
struct OrificeDamper final : Attachment {
  double per_speed = 0;
  void act(double, double, double v, const double*, double*, Forces& forces) const override {
    forces.damper *= 1 + per_speed * std::abs(v);
  }
};

std::optional<Formed> orifice(const Surroundings& rig, const std::string& place, Random&) {
  const Index e = element_at(*rig.plan, place);
  const double speed = motion_of(rig, e).speed_rms;
  if (!(speed > 0)) return std::nullopt;
  return Formed{1e-3, 2, [=](double size) {
                  OrificeDamper f;
                  f.per_speed = size / speed;
                  return on_element(e, f, f.per_speed, "s/m");
                }};
}

/// d v (1 + b x^2): a damper whose bypass closes away from the middle.
struct BypassDamper final : Attachment {
  double per_square = 0;
  void act(double, double x, double, const double*, double*, Forces& forces) const override {
    forces.damper *= 1 + per_square * x * x;
  }
};

std::optional<Formed> bypass(const Surroundings& rig, const std::string& place, Random&) {
  const Index e = element_at(*rig.plan, place);
  const double usual = motion_of(rig, e).rms;
  if (!(usual > 0)) return std::nullopt;
  return Formed{1e-3, 2, [=](double size) {
                  BypassDamper f;
                  f.per_square = size / (usual * usual);
                  return on_element(e, f, f.per_square, "1/m^2");
                }};
}

/// d (1 - a T) with one heat capacity and one resistance to the air.
struct WarmDamper final : Attachment {
  double per_kelvin = 0, capacity = 0, seconds = 0;
  int states() const override { return 1; }
  void act(double, double, double v, const double* z, double* z_rate, Forces& forces) const override {
    forces.damper *= std::max(1 - per_kelvin * z[0], 0.1);
    z_rate[0] = forces.damper * v / capacity - z[0] / seconds;
  }
};

std::optional<Formed> warm_damper(const Surroundings& rig, const std::string& place, Random& random) {
  const Index e = element_at(*rig.plan, place);
  const double speed = motion_of(rig, e).speed_rms;
  const double power = base_laws(*rig.plan, rig.theta, e).damping * speed * speed;
  if (!(power > 0)) return std::nullopt;
  WarmDamper shape;
  shape.seconds = rig.duration_s * between(random, 1, 4);
  shape.capacity = power * rig.duration_s / 20;  // twenty degrees in a record without losses
  return Formed{1e-4, 0.08, [=](double size) {
                  WarmDamper f = shape;
                  f.per_kelvin = size;
                  return on_element(e, f, size, "1/K");
                }};
}

/// No force at all until the piston has gone the dead travel back, then all of it.
struct SharpDeadTravel final : Attachment {
  double side = 1, travel = 0;
  double turned_at = 0;  ///< side * x where the stroke began
  void act(double, double x, double v, const double*, double*, Forces& forces) const override {
    if (side * v > 0 && side * x - turned_at < travel) forces.damper = 0;
  }
  void accept(double, double x, double v) override {
    if (side * v <= 0 || side * x < turned_at) turned_at = side * x;
  }
};

std::optional<Formed> sharp_dead_travel(const Surroundings& rig, const std::string& place, Random& random) {
  const Index e = element_at(*rig.plan, place);
  const double usual = motion_of(rig, e).rms, side = either_sign(random);
  if (usual == 0) return std::nullopt;
  return Formed{1e-3 * usual, 1.5 * usual, [=](double size) {
                  SharpDeadTravel f;
                  f.side = side;
                  f.travel = size;
                  return on_element(e, f, size, "m");
                }};
}

/// c d (1 + a d + b d^2) of a tyre.
struct PolynomialTyre final : Attachment {
  double square = 0, cube = 0;
  void act(double, double x, double, const double*, double*, Forces& forces) const override {
    forces.spring *= 1 + square * x + cube * x * x;
  }
};

std::optional<Formed> polynomial_tyre(const Surroundings& rig, const std::string& place, Random& random) {
  const Index e = element_at(*rig.plan, place);
  const double usual = motion_of(rig, e).rms, sign = either_sign(random), cube = between(random, 0, 0.5);
  if (!(usual > 0)) return std::nullopt;
  return Formed{1e-3, 0.3, [=](double size) {
                  PolynomialTyre f;
                  f.square = sign * size / usual;
                  f.cube = cube * size / (usual * usual);
                  return on_element(e, f, f.square, "1/m");
                }};
}

/// A dashpot beside the tyre's spring.
struct TyreDashpot final : Attachment {
  double damping = 0;
  void act(double, double, double v, const double*, double*, Forces& forces) const override {
    forces.extra += damping * v;
  }
};

std::optional<Formed> tyre_dashpot(const Surroundings& rig, const std::string& place, Random&) {
  const Index e = element_at(*rig.plan, place);
  const double stiffness = base_laws(*rig.plan, rig.theta, e).stiffness_at_rest();
  if (!(stiffness > 0)) return std::nullopt;
  return Formed{1e-5 * stiffness, 0.015 * stiffness, [=](double size) {
                  TyreDashpot f;
                  f.damping = size;
                  return on_element(e, f, size, "Ns/m");
                }};
}

}  // namespace

std::vector<EffectKind> textbook_kinds() {
  return {{"coulomb_friction", "smoothed sign", struts, dry_friction, true},
          {"hysteresis", "Bouc-Wen with an exponent of two", struts, bouc_wen},
          {"series_compliance", "damper behind a mount", struts, damper_mount, true},
          {"bump_stop", "power on both sides", struts, power_stops},
          {"backlash", "dead band", struts, dead_band, true},
          {"spring_nonlinearity", "hyperbolic", struts, curved_spring},
          {"damper_asymmetry", "two slopes", struts, two_slopes, true},
          {"damper_nonlinearity", "saturated by a hyperbolic tangent", struts, saturated_damper},
          {"damper_nonlinearity", "orifice", struts, orifice},
          {"damper_nonlinearity", "bypass", struts, bypass, true},
          {"damper_fade", "linear in the temperature", struts, warm_damper, true},
          {"cavitation", "no force over the dead travel", struts, sharp_dead_travel},
          {"tyre_nonlinearity", "polynomial", driven_springs, polynomial_tyre, true},
          {"tyre_damping", "dashpot", driven_springs, tyre_dashpot, true}};
}

}  // namespace wheelhop::blind
