#include <algorithm>
#include <cmath>

#include "core/plant/simulate.hpp"

namespace wheelhop {
namespace {

Equilibrium failed(Status status, std::string message) { return {status, std::move(message), {}}; }

Matrix mass_block(const Matrix& M, Index n) { return M.topLeftCorner(n, n); }

Equilibrium outside(const Plant& plant, int element) {
  return failed(Status::outside_domain, "no equilibrium: element \"" +
                                            plant.elements[static_cast<std::size_t>(element)].name +
                                            "\" leaves the domain of its laws");
}

/// Damped Newton iteration from q, under the inputs set before.
Equilibrium balance(const Plant& plant, Motion& motion, Vector q, const Matrix& masses, double applied,
                    double largest_input) {
  const Index n = motion.masses();
  const Vector rest = Vector::Zero(n);
  Matrix stiffness, damping;
  Vector a(n), trial(n), trial_a(n);
  if (const int element = motion.accelerations(q.data(), rest.data(), a.data()); element >= 0)
    return outside(plant, element);
  const auto force_norm = [&](const Vector& acceleration) { return (masses * acceleration).norm(); };
  for (int iteration = 0; iteration < 100; ++iteration) {
    if (const int element = motion.slopes(q.data(), rest.data(), stiffness, damping); element >= 0)
      return outside(plant, element);
    const Matrix K = mass_block(stiffness, n);
    const double scale = K.cwiseAbs().maxCoeff() * (q.cwiseAbs().maxCoeff() + largest_input) + applied;
    if (force_norm(a) <= 1e-12 * scale) return {Status::ok, "", q};
    const LeastSquares step = least_squares(K, masses * a);
    if (step.rank < n && step.residual_norm > 1e-9 * scale)
      return failed(Status::rank_deficient, "no equilibrium: a constant force is balanced by no spring");
    double share = 1;
    for (int halving = 0; halving < 60; ++halving, share /= 2) {
      trial = q + share * step.x;
      if (motion.accelerations(trial.data(), rest.data(), trial_a.data()) == Motion::all_defined &&
          force_norm(trial_a) < force_norm(a))
        break;
    }
    // Round-off: no step improves the balance of forces any more.
    if (share < 1e-15) {
      if (force_norm(a) <= 1e-9 * scale) return {Status::ok, "", q};
      break;
    }
    q = trial;
    a = trial_a;
  }
  return failed(Status::iteration_limit, "no equilibrium found for the first drive sample");
}

}  // namespace

Equilibrium static_equilibrium(const Plant& plant, ConstVectorRef u) {
  Motion motion(plant);
  const Index n = motion.masses();
  if (u.size() != motion.inputs()) throw UserError("static_equilibrium: expected one constant value an input");
  if (n == 0) return {Status::ok, "", Vector(0)};
  const Vector rest = Vector::Zero(std::max(n, motion.inputs()));
  const Matrix masses = motion.mass_matrix();

  // First guess from the slopes at zero travel, where every law is defined: a drive that starts far from zero would
  // put the elements between it and the masses outside their domain.
  Matrix stiffness, damping;
  motion.set_play_leak(1);
  motion.set_inputs(rest.data(), rest.data());
  if (const int element = motion.slopes(rest.data(), rest.data(), stiffness, damping); element >= 0)
    return outside(plant, element);
  Vector applied = Vector::Zero(motion.node_count());
  applied.head(n) = motion.load_forces();
  for (Index i = 0; i < motion.inputs(); ++i) {
    if (motion.input_node(i) >= 0) {
      applied -= stiffness.col(motion.input_node(i)) * u(i);
    } else {
      applied.head(n) += motion.input_forces(i) * u(i);
    }
  }
  Vector q = least_squares(mass_block(stiffness, n), applied.head(n)).x;

  motion.set_inputs(u.data(), rest.data());
  double largest_input = 0;
  for (Index i = 0; i < motion.inputs(); ++i)
    if (plant.inputs[static_cast<std::size_t>(i)].moves()) largest_input = std::max(largest_input, std::abs(u(i)));
  // A clearance has no slope inside: it is closed at first and opened step by step, each from the place before.
  Equilibrium result{Status::ok, "", q};
  for (const double leak : {1.0, 0.1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-9}) {
    motion.set_play_leak(leak);
    result = balance(plant, motion, result.positions, masses, applied.cwiseAbs().maxCoeff(), largest_input);
    if (result.status != Status::ok || !motion.has_play()) break;
  }
  return result;
}

}  // namespace wheelhop
