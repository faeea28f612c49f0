// Effects of springs that a displacement input moves: tyres.
#include <algorithm>
#include <cmath>

#include "experiments/rig/effects.hpp"

namespace wheelhop::blind {
namespace {

/// 1 where growing travel relieves the tyre (`between` [road, wheel]), -1 the other way round.
double relief(const Plan& plan, Index element) {
  const PlanElement& e = plan.elements[static_cast<std::size_t>(element)];
  return plan.nodes[static_cast<std::size_t>(e.from)].input >= 0 ? 1 : -1;
}

/// Force over deflection to a power about the static deflection; the slope there is that of the delivered spring.
struct PowerLaw final : Attachment {
  double side = 1, exponent = 1, rest = 0, factor = 0;
  double press(double deflection) const { return deflection > 0 ? factor * std::pow(deflection, exponent) : 0; }
  void act(double, double x, double, const double*, double*, Forces& forces) const override {
    forces.spring = side * (press(rest) - press(rest - side * x));
  }
};

std::optional<Formed> power_law(const Surroundings& rig, const std::string& place, Random&) {
  const Index e = element_at(*rig.plan, place);
  const double load = rig.static_load_n(e), stiffness = base_laws(*rig.plan, rig.theta, e).stiffness_at_rest();
  if (!(load > 0) || !(stiffness > 0)) return std::nullopt;
  const double side = relief(*rig.plan, e), rest = load / stiffness;
  return Formed{1e-3, 0.5, [=](double size) {
                  PowerLaw f;
                  f.side = side;
                  f.exponent = 1 + size;
                  f.rest = rest;
                  f.factor = stiffness / (f.exponent * std::pow(rest, size));
                  return on_element(e, f, f.exponent, "-");
                }};
}

/// A dashpot behind a spring, so that a step of the road meets no infinite force.
struct Maxwell final : Attachment {
  double stiffness = 0, time = 0;
  int states() const override { return 1; }
  void act(double, double x, double, const double* z, double* z_rate, Forces& forces) const override {
    forces.extra += stiffness * (x - z[0]);
    z_rate[0] = (x - z[0]) / time;
  }
};

std::optional<Formed> damping(const Surroundings& rig, const std::string& place, Random& random) {
  const Index e = element_at(*rig.plan, place);
  const double stiffness = base_laws(*rig.plan, rig.theta, e).stiffness_at_rest(), time = between(random, 1e-3, 2.5e-3);
  if (!(stiffness > 0)) return std::nullopt;
  // A rolling tyre has 50 to 500 Ns/m over 2e5 N/m; a loss factor of one half at 10 Hz bounds it.
  return Formed{1e-5 * stiffness, 0.015 * stiffness, [=](double size) {
                  Maxwell f;
                  f.stiffness = size / time;
                  f.time = time;
                  return on_element(e, f, size, "Ns/m");
                }};
}

/// A tyre cannot pull: its force ends where the static load is used up.
struct Unilateral final : Attachment {
  double side = 1, load = 0;
  void act(double, double, double, const double*, double*, Forces& forces) const override {
    const double beyond = side * forces.total() - load;
    if (beyond > 0) forces.extra -= side * beyond;
  }
};

/// Size is the full static load over what is left of it where the rig carries a part of the weight.
std::optional<Formed> liftoff(const Surroundings& rig, const std::string& place, Random&) {
  const Index e = element_at(*rig.plan, place);
  const double load = rig.static_load_n(e), side = relief(*rig.plan, e);
  if (!(load > 0)) return std::nullopt;
  return Formed{0.2, 5, [=](double size) {
                  Unilateral f;
                  f.side = side;
                  f.load = load / size;
                  return on_element(e, f, f.load, "N");
                }};
}

}  // namespace

std::vector<EffectKind> tyre_kinds() {
  return {{"tyre_nonlinearity", "power law about the static load", driven_springs, power_law},
          {"tyre_damping", "Maxwell branch", driven_springs, damping},
          {"tyre_liftoff", "unilateral contact", driven_springs, liftoff}};
}

}  // namespace wheelhop::blind
