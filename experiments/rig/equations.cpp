#include "experiments/rig/equations.hpp"

#include <cmath>
#include <numbers>

namespace wheelhop::blind {

double BaseLaws::spring(double x) const {
  double force = linear_stiffness * x;
  for (const Spring& s : springs) {
    if (!s.coefficients.empty()) {
      double power = x;
      for (const double c : s.coefficients) {
        force += c * power;
        power *= x;
      }
      continue;
    }
    double shape = x + s.alpha * x * x * x;
    if (s.limit > 0) {
      if (!(std::abs(x) < s.limit)) throw RigFailure("an end stop was overrun");
      shape += s.beta * std::tan(std::numbers::pi * x / (2 * s.limit));
    }
    force += s.stiffness * shape;
  }
  return force;
}

double BaseLaws::stiffness_at_rest() const {
  constexpr double step = 1e-6;
  return (spring(step) - spring(-step)) / (2 * step);
}

BaseLaws base_laws(const Plan& plan, const Vector& theta, Index element) {
  const auto value = [&](Index at) { return at < 0 ? 0.0 : theta(at); };
  BaseLaws laws;
  for (const PlanLaw& law : plan.elements[static_cast<std::size_t>(element)].laws) {
    BaseLaws::Spring spring;
    switch (law.shape) {
      case LawShape::linear_spring: laws.linear_stiffness += value(law.at[0]); break;
      case LawShape::viscous_damper: laws.damping += value(law.at[0]); break;
      case LawShape::hardening_spring:
        spring.stiffness = value(law.at[0]);
        spring.alpha = value(law.at[1]);
        spring.beta = value(law.at[2]);
        spring.limit = spring.beta != 0 ? value(law.at[3]) : 0;
        laws.springs.push_back(spring);
        break;
      case LawShape::polynomial_spring:
        for (const Index at : law.at) spring.coefficients.push_back(value(at));
        laws.springs.push_back(spring);
        break;
    }
  }
  return laws;
}

Equations::Equations(const Plan& plan, const Vector& theta, const std::vector<Mount>& mounts)
    : plan_(plan), n_(plan.mass_count()), size_(2 * n_), masses_(theta.head(n_)), on_mass_(plan.masses.size()) {
  for (std::size_t e = 0; e < plan.elements.size(); ++e)
    elements_.push_back({static_cast<std::size_t>(plan.elements[e].from),
                         static_cast<std::size_t>(plan.elements[e].to),
                         base_laws(plan, theta, static_cast<Index>(e)),
                         {}});
  for (const Mount& mount : mounts) {
    Mounted mounted{mount.make(), size_};
    size_ += mounted.attachment->states();
    const auto at = static_cast<std::size_t>(mount.at);
    (mount.on_mass ? on_mass_[at] : elements_[at].mounted).push_back(std::move(mounted));
  }
  for (std::vector<double>* values : {&position_, &speed_, &force_, &acceleration_})
    values->assign(plan.nodes.size(), 0.0);
  u_.assign(plan.inputs.size(), 0.0);
}

void Equations::set_inputs(const double* u, const double* u_rate) {
  for (std::size_t i = 0; i < u_.size(); ++i) u_[i] = u[i];
  for (std::size_t i = 0; i < plan_.nodes.size(); ++i)
    if (const Index input = plan_.nodes[i].input; input >= 0) {
      position_[i] = u[input];
      speed_[i] = u_rate[input];
    }
}

void Equations::place(const Vector& state) {
  for (std::size_t i = 0; i < plan_.nodes.size(); ++i) {
    const auto& weights = plan_.nodes[i].weights;
    if (weights.empty()) continue;
    double x = 0, v = 0;
    for (const auto& [mass, weight] : weights) {
      x += weight * state(mass);
      v += weight * state(n_ + mass);
    }
    position_[i] = x;
    speed_[i] = v;
  }
}

void Equations::rates(double t, const Vector& state, Vector& rate) {
  place(state);
  std::fill(force_.begin(), force_.end(), 0.0);
  for (std::size_t e = 0; e < elements_.size(); ++e) {
    const Link& link = elements_[e];
    const double x = travel(e), v = travel_rate(e);
    Forces forces{&link.laws, link.laws.spring(x), link.laws.damping * v};
    for (const Mounted& m : link.mounted)
      m.attachment->act(t, x, v, state.data() + m.offset, rate.data() + m.offset, forces);
    const double force = forces.total();
    force_[link.to] -= force;
    force_[link.from] += forces.share_at_from * force;
  }
  for (std::size_t i = 0; i < on_mass_.size(); ++i)
    for (const Mounted& m : on_mass_[i]) {
      Forces forces;
      m.attachment->act(t, position_[i], speed_[i], state.data() + m.offset, rate.data() + m.offset, forces);
      force_[i] += forces.extra;
    }
  for (std::size_t i = 0; i < plan_.inputs.size(); ++i)
    if (const PlanInput& input = plan_.inputs[i]; input.is_force) {
      force_[static_cast<std::size_t>(input.from)] -= u_[i];
      force_[static_cast<std::size_t>(input.to)] += u_[i];
    }
  rate.segment(n_, n_).setZero();
  for (std::size_t i = 0; i < plan_.nodes.size(); ++i)
    for (const auto& [mass, weight] : plan_.nodes[i].weights) rate(n_ + mass) += weight * force_[i];
  rate.segment(n_, n_).array() /= masses_.array();
  rate.head(n_) = state.segment(n_, n_);
  for (std::size_t i = 0; i < plan_.nodes.size(); ++i) {
    double a = 0;
    for (const auto& [mass, weight] : plan_.nodes[i].weights) a += weight * rate(n_ + mass);
    acceleration_[i] = a;
  }
}

void Equations::accept(double t, const Vector& state) {
  place(state);
  for (std::size_t e = 0; e < elements_.size(); ++e)
    for (Mounted& m : elements_[e].mounted) m.attachment->accept(t, travel(e), travel_rate(e));
  for (std::size_t i = 0; i < on_mass_.size(); ++i)
    for (Mounted& m : on_mass_[i]) m.attachment->accept(t, position_[i], speed_[i]);
}

void Equations::outputs(double* y) const {
  for (std::size_t i = 0; i < plan_.sensors.size(); ++i) {
    const PlanSensor& sensor = plan_.sensors[i];
    const std::vector<double>& values = sensor.reading == Reading::displacement ? position_
                                        : sensor.reading == Reading::velocity   ? speed_
                                                                                : acceleration_;
    y[i] = values[static_cast<std::size_t>(sensor.to)] - values[static_cast<std::size_t>(sensor.from)];
  }
}

}  // namespace wheelhop::blind
