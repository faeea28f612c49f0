// Effects of guides, elements and dampers that came after the first sets of cases had been sealed.
#include <algorithm>
#include <cmath>

#include "experiments/rig/effects.hpp"

namespace wheelhop::blind {
namespace {

/// Friction of a slide against the ground by Stribeck's curve: more force just off standstill than in sliding, by a
/// power of the speed (Armstrong-Hélouvry, Dupont & Canudas de Wit 1994, Automatica 30, eq. 6, have 0.5 to 2).
struct StribeckGuide final : Attachment {
  double sliding = 0, stick_share = 1, stribeck_speed = 0, power = 1, width = 0;
  void act(double, double, double v, const double*, double*, Forces& forces) const override {
    const double fading = std::exp(-std::pow(std::abs(v) / stribeck_speed, power));
    forces.extra -= sliding * (1 + (stick_share - 1) * fading) * v / std::hypot(v, width);
  }
};

/// Inertia force of a mass in its usual motion [N], as if that were one sine: m v^2 / x.
double usual_inertia(const Surroundings& rig, Index mass) {
  const Extent& motion = rig.masses[static_cast<std::size_t>(mass)];
  return motion.rms > 0 ? rig.theta(mass) * motion.speed_rms * motion.speed_rms / motion.rms : 0;
}

std::optional<Formed> stribeck_guide(const Surroundings& rig, const std::string& place, Random& random) {
  const Index i = mass_at(*rig.plan, place);
  const double speed = rig.masses[static_cast<std::size_t>(i)].speed_rms, usual = usual_inertia(rig, i);
  if (!(usual > 0)) return std::nullopt;
  StribeckGuide shape;
  shape.stick_share = between(random, 1.1, 1.6);
  shape.stribeck_speed = speed * between(random, 0.1, 0.4);
  shape.power = between(random, 0.5, 2);
  shape.width = speed * between(random, 0.02, 0.06);
  return Formed{1e-4 * usual, 3 * usual, [=](double size) {
                  StribeckGuide f = shape;
                  f.sliding = size;
                  return on_mass(i, f, size, "N");
                }};
}

/// Dahl's friction (1968): a slide that yields elastically before it moves.
struct DahlGuide final : Attachment {
  double force = 0, presliding = 0;
  int states() const override { return 1; }
  void act(double, double, double v, const double* z, double* z_rate, Forces& forces) const override {
    z_rate[0] = (v - std::abs(v) * z[0]) / presliding;
    forces.extra -= force * z[0];
  }
};

std::optional<Formed> dahl_guide(const Surroundings& rig, const std::string& place, Random& random) {
  const Index i = mass_at(*rig.plan, place);
  const double usual = usual_inertia(rig, i);
  if (!(usual > 0)) return std::nullopt;
  const double presliding = rig.masses[static_cast<std::size_t>(i)].rms * log_between(random, 0.008, 0.03);
  return Formed{1e-4 * usual, 3 * usual, [=](double size) {
                  DahlGuide f;
                  f.force = size;
                  f.presliding = presliding;
                  return on_mass(i, f, size, "N");
                }};
}

/// A flywheel that the travel turns through a shaft: below the frequency at which it swings on the shaft its force is
/// its inertance times the relative acceleration.
struct Flywheel final : Attachment {
  double inertance = 0, stiffness = 0, damping = 0;
  int states() const override { return 2; }
  void act(double, double x, double v, const double* z, double* z_rate, Forces& forces) const override {
    const double force = stiffness * (x - z[0]) + damping * (v - z[1]);
    forces.extra += force;
    z_rate[0] = z[1];
    z_rate[1] = force / inertance;
  }
};

/// Mass [kg] that a force on the node would have to accelerate.
double mass_felt(const Surroundings& rig, Index node) {
  double mobility = 0;
  for (const auto& [mass, weight] : rig.plan->nodes[static_cast<std::size_t>(node)].weights)
    mobility += weight * weight / rig.theta(mass);
  return 1 / mobility;
}

/// Struts with masses at both ends: against the ground an inerter is a mass, which re-tuning finds.
std::vector<std::string> struts_between_masses(const Plan& plan) {
  std::vector<std::string> names;
  for (const std::string& name : struts(plan)) {
    const PlanElement& element = plan.elements[static_cast<std::size_t>(element_at(plan, name))];
    const auto moves = [&](Index node) { return !plan.nodes[static_cast<std::size_t>(node)].weights.empty(); };
    if (moves(element.from) && moves(element.to)) names.push_back(name);
  }
  return names;
}

/// Size is the inertance over the smaller of the masses at the ends; inerters of suspensions have 0.01 to 0.1.
std::optional<Formed> flywheel(const Surroundings& rig, const std::string& place, Random& random) {
  const Index e = element_at(*rig.plan, place);
  const PlanElement& element = rig.plan->elements[static_cast<std::size_t>(e)];
  const double host = std::min(mass_felt(rig, element.from), mass_felt(rig, element.to));
  const double w = two_pi * rig.band_hz * between(random, 4, 8), ratio = between(random, 0.1, 0.3);
  return Formed{1e-3, 0.3, [=](double size) {
                  Flywheel f;
                  f.inertance = size * host;
                  f.stiffness = f.inertance * w * w;
                  f.damping = 2 * ratio * w * f.inertance;
                  return on_element(e, f, f.inertance, "kg");
                }};
}

/// Oil that thins with the work done on it and gives no heat away: the damping falls as 1 / (1 + work / scale).
struct ThinningOil final : Attachment {
  double per_joule = 0;
  int states() const override { return 1; }
  void act(double, double, double v, const double* z, double* z_rate, Forces& forces) const override {
    forces.damper /= 1 + per_joule * std::max(z[0], 0.0);
    z_rate[0] = forces.damper * v;
  }
};

/// Size is the share of the damping that the usual work of one record takes away.
std::optional<Formed> thinning_oil(const Surroundings& rig, const std::string& place, Random&) {
  const Index e = element_at(*rig.plan, place);
  const double speed = motion_of(rig, e).speed_rms;
  const double work = base_laws(*rig.plan, rig.theta, e).damping * speed * speed * rig.duration_s;
  if (!(work > 0)) return std::nullopt;
  return Formed{1e-3, 0.7, [=](double size) {
                  ThinningOil f;
                  f.per_joule = size / (1 - size) / work;
                  return on_element(e, f, size, "-");
                }};
}

}  // namespace

std::vector<EffectKind> added_plant_kinds() {
  return {{"coulomb_friction", "Stribeck on a guide", guides, stribeck_guide},
          {"coulomb_friction", "Dahl on a guide", guides, dahl_guide, true},
          {"inertance", "flywheel behind a shaft", struts_between_masses, flywheel},
          {"damper_fade", "oil that thins by work", struts, thinning_oil}};
}

}  // namespace wheelhop::blind
