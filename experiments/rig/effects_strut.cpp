// Effects of springs and joints between two masses.
#include <algorithm>
#include <array>
#include <cmath>

#include "experiments/rig/effects.hpp"

namespace wheelhop::blind {
namespace {

/// LuGre friction (Canudas de Wit, Olsson, Astrom & Lischinsky 1995): bristles of stiffness s0 and damping s1, Stribeck
/// curve g between break-away force and Coulomb force. The bristle damping fades with speed, which keeps it passive.
struct LuGre final : Attachment {
  double coulomb = 0, breakaway = 0, stribeck_speed = 0, bristle = 0, bristle_damping = 0;
  int states() const override { return 1; }
  void act(double, double, double v, const double* z, double* z_rate, Forces& forces) const override {
    const double ratio = v / stribeck_speed, fading = std::exp(-ratio * ratio);
    const double g = coulomb + (breakaway - coulomb) * fading;
    z_rate[0] = v - bristle * std::abs(v) / g * z[0];
    forces.extra += bristle * z[0] + bristle_damping * fading * z_rate[0];
  }
};

std::optional<Formed> friction(const Surroundings& rig, const std::string& place, Random& random) {
  const Index e = element_at(*rig.plan, place);
  const Extent& motion = motion_of(rig, e);
  if (motion.speed_rms == 0) return std::nullopt;
  const double stick_share = between(random, 1.1, 1.6), speed = motion.speed_rms * between(random, 0.1, 0.4);
  const double presliding = motion.rms * log_between(random, 0.008, 0.03);
  // In proportion to what the damper and the spring hold at their usual motion.
  const double usual = usual_force(rig, e);
  return Formed{1e-4 * usual, 2 * usual, [=](double size) {
                  LuGre f;
                  f.coulomb = size;
                  f.breakaway = stick_share * size;
                  f.stribeck_speed = speed;
                  f.bristle = size / presliding;
                  f.bristle_damping = 0.3 * size / motion.speed_rms;
                  return on_element(e, f, size, "N");
                }};
}

/// Iwan's hysteresis: springs, each with a slider of its own limit (Jenkins elements). Between two accepted steps the
/// travel is monotone, so that each slider's spring is exactly the clamped sum of its last stretch and the travel
/// since.
struct Iwan final : Attachment {
  static constexpr std::size_t count = 6;
  std::array<double, count> stiffness = {}, yield = {}, stretch = {};
  double last_travel = 0;
  double stretched(std::size_t i, double x) const {
    return std::clamp(stretch[i] + (x - last_travel), -yield[i], yield[i]);
  }
  void act(double, double x, double, const double*, double*, Forces& forces) const override {
    for (std::size_t i = 0; i < count; ++i) forces.extra += stiffness[i] * stretched(i, x);
  }
  void accept(double, double x, double) override {
    for (std::size_t i = 0; i < count; ++i) stretch[i] = stretched(i, x);
    last_travel = x;
  }
};

std::optional<Formed> hysteresis(const Surroundings& rig, const std::string& place, Random& random) {
  const Index e = element_at(*rig.plan, place);
  const Extent& motion = motion_of(rig, e);
  if (motion.rms == 0) return std::nullopt;
  Iwan shape;
  const double least = motion.rms * between(random, 0.05, 0.1), most = motion.rms * between(random, 0.5, 0.9);
  std::array<double, Iwan::count> share = {};
  double sum = 0;
  for (std::size_t i = 0; i < Iwan::count; ++i) {
    shape.yield[i] = least * std::pow(most / least, static_cast<double>(i) / (Iwan::count - 1));
    sum += share[i] = between(random, 0.5, 1.5);
  }
  const double usual = usual_force(rig, e);
  return Formed{1e-4 * usual, 2 * usual, [=](double size) {
                  Iwan f = shape;
                  for (std::size_t i = 0; i < Iwan::count; ++i) f.stiffness[i] = size * share[i] / sum / f.yield[i];
                  return on_element(e, f, size, "N");
                }};
}

/// Two branches of a spring in series with a dashpot: the standard linear solid with two relaxation times.
struct Relaxation final : Attachment {
  std::array<double, 2> stiffness = {}, time = {};
  int states() const override { return 2; }
  void act(double, double x, double, const double* z, double* z_rate, Forces& forces) const override {
    for (std::size_t i = 0; i < 2; ++i) {
      forces.extra += stiffness[i] * (x - z[i]);
      z_rate[i] = (x - z[i]) / time[i];
    }
  }
};

std::optional<Formed> relaxation(const Surroundings& rig, const std::string& place, Random& random) {
  const Index e = element_at(*rig.plan, place);
  const double share = between(random, 0.4, 0.7), fast = between(random, 0.04, 0.08), slow = between(random, 0.2, 0.4);
  const double stiffness = std::max(base_laws(*rig.plan, rig.theta, e).stiffness_at_rest(), 1e-3);
  return Formed{1e-4 * stiffness, 10 * stiffness, [=, band = rig.band_hz](double size) {
                  Relaxation f;
                  f.stiffness = {share * size, (1 - share) * size};
                  f.time = {fast / band, slow / band};
                  return on_element(e, f, size, "N/m");
                }};
}

/// F = k l (exp(d / l) - 1) at depth d beyond the gap, on one side.
struct ExponentialStop final : Attachment {
  double side = 1, gap = 0, length = 0, stiffness = 0;
  void act(double, double x, double, const double*, double*, Forces& forces) const override {
    const double depth = side * x - gap;
    if (depth > 0) forces.extra += side * stiffness * length * std::expm1(std::min(depth / length, 30.0));
  }
};

std::optional<Formed> bump_stop(const Surroundings& rig, const std::string& place, Random& random) {
  const Index e = element_at(*rig.plan, place);
  const Extent& motion = motion_of(rig, e);
  ExponentialStop shape;
  shape.side = either_sign(random);
  const double reach = shape.side > 0 ? motion.most : -motion.least;
  if (!(reach > 0)) return std::nullopt;
  shape.gap = reach * between(random, 0.45, 0.7);
  shape.length = reach * between(random, 0.1, 0.25);
  const double stiffness = std::max(base_laws(*rig.plan, rig.theta, e).stiffness_at_rest(), 1e-3);
  return Formed{1e-3 * stiffness, 30 * stiffness, [=](double size) {
                  ExponentialStop f = shape;
                  f.stiffness = size;
                  return on_element(e, f, size, "N/m");
                }};
}

/// The spring has play; at the seat a contact damping that grows with depth (Hunt & Crossley 1975) and never pulls.
struct Play final : Attachment {
  double gap = 0, contact_time = 0;
  void act(double, double x, double v, const double*, double*, Forces& forces) const override {
    const double depth = x - std::clamp(x, -gap, gap);
    const double elastic = forces.base->spring(depth);
    const double share = std::max(0.0, 1 + contact_time * v * (depth > 0 ? 1 : -1) / (std::abs(depth) + gap + 1e-9));
    forces.spring = elastic * std::min(share, 3.0);
  }
};

std::optional<Formed> backlash(const Surroundings& rig, const std::string& place, Random& random) {
  const Index e = element_at(*rig.plan, place);
  const Extent& motion = motion_of(rig, e);
  if (motion.rms == 0) return std::nullopt;
  const double time = between(random, 0.2e-3, 0.6e-3);
  return Formed{1e-4 * motion.rms, 0.7 * motion.rms, [=](double size) {
                  Play f;
                  f.gap = size;
                  f.contact_time = time;
                  return on_element(e, f, size, "m");
                }};
}

/// Straight pieces: helper springs that engage at a knee on either side.
struct HelperSprings final : Attachment {
  double knee_out = 0, knee_in = 0, stiffness_out = 0, stiffness_in = 0;
  void act(double, double x, double, const double*, double*, Forces& forces) const override {
    if (x > knee_out) forces.extra += stiffness_out * (x - knee_out);
    if (x < -knee_in) forces.extra += stiffness_in * (x + knee_in);
  }
};

std::optional<Formed> helper_springs(const Surroundings& rig, const std::string& place, Random& random) {
  const Index e = element_at(*rig.plan, place);
  const Extent& motion = motion_of(rig, e);
  if (motion.rms == 0) return std::nullopt;
  HelperSprings shape;
  shape.knee_out = motion.rms * between(random, 0.4, 1.0);
  shape.knee_in = motion.rms * between(random, 0.4, 1.0);
  const double other = between(random, -0.4, 0.8), stiffness = base_laws(*rig.plan, rig.theta, e).stiffness_at_rest();
  const bool swap = random.uniform() < 0.5;
  return Formed{1e-3, 3, [=](double size) {
                  HelperSprings f = shape;
                  f.stiffness_out = size * stiffness * (swap ? other : 1);
                  f.stiffness_in = size * stiffness * (swap ? 1 : other);
                  return on_element(e, f, size, "-");
                }};
}

/// The spring works about another point: F(x + x0) - F(x0).
struct RideHeight final : Attachment {
  double offset = 0;
  void act(double, double x, double, const double*, double*, Forces& forces) const override {
    forces.spring = forces.base->spring(x + offset) - forces.base->spring(offset);
  }
};

std::optional<Formed> ride_height(const Surroundings& rig, const std::string& place, Random& random) {
  const Index e = element_at(*rig.plan, place);
  const Extent& motion = motion_of(rig, e);
  const BaseLaws laws = base_laws(*rig.plan, rig.theta, e);
  if (laws.springs.empty() || motion.rms == 0) return std::nullopt;
  double room = 4 * motion.rms;
  for (const BaseLaws::Spring& spring : laws.springs)
    if (spring.limit > 0) room = std::min(room, 0.95 * spring.limit - std::max(motion.most, -motion.least));
  const double sign = either_sign(random);
  if (!(room > 0)) return std::nullopt;
  return Formed{1e-3 * room, room, [=](double size) {
                  RideHeight f;
                  f.offset = sign * size;
                  return on_element(e, f, sign * size, "m");
                }};
}

}  // namespace

std::vector<EffectKind> strut_kinds() {
  return {{"coulomb_friction", "LuGre with Stribeck", struts, friction},
          {"hysteresis", "Iwan, six Jenkins elements", struts, hysteresis},
          {"series_compliance", "two Zener branches", struts, relaxation},
          {"bump_stop", "exponential, one side", struts, bump_stop},
          {"backlash", "play with contact damping", struts, backlash},
          {"spring_nonlinearity", "straight pieces", struts, helper_springs},
          {"static_offset", "ride height", struts, ride_height}};
}

}  // namespace wheelhop::blind
