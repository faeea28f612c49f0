#include "core/plant/linearise.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace wheelhop {
namespace {

/// Rows that give position, velocity or acceleration of a node from x, u and u'.
struct Row {
  Eigen::RowVectorXd c, d, d_rate;
};

Row node_row(const LinearPlant& model, const Motion& motion, SensorKind kind, Index node) {
  const Index n = motion.masses(), m = motion.inputs();
  Row row{Eigen::RowVectorXd::Zero(model.A.cols()), Eigen::RowVectorXd::Zero(m), Eigen::RowVectorXd::Zero(m)};
  for (const Motion::Weight& weight : motion.weights(node)) {
    switch (kind) {
      case SensorKind::displacement: row.c(weight.mass) += weight.value; break;
      case SensorKind::velocity: row.c(n + weight.mass) += weight.value; break;
      case SensorKind::acceleration:
        row.c += weight.value * model.A.row(n + weight.mass);
        row.d += weight.value * model.B.row(n + weight.mass);
        row.d_rate += weight.value * model.B_rate.row(n + weight.mass);
        break;
      case SensorKind::force: break;  // of an element, no node
    }
  }
  for (Index i = 0; i < m; ++i) {
    if (motion.input_node(i) != node) continue;
    if (kind == SensorKind::displacement) row.d(i) = 1;
    if (kind == SensorKind::velocity) row.d_rate(i) = 1;
  }
  return row;
}

Row sensor_row(const LinearPlant& model, const Motion& motion, const Motion::Slopes& slopes, Index k) {
  const Motion::SensorPlace& place = motion.sensor(k);
  const bool force = place.kind == SensorKind::force;
  const SensorKind kind = force ? SensorKind::acceleration : place.kind;
  const Row from = node_row(model, motion, kind, place.from), to = node_row(model, motion, kind, place.to);
  Row row{to.c - from.c, to.d - from.d, to.d_rate - from.d_rate};
  for (Index i = 0; i < motion.inputs(); ++i)
    if (motion.accelerates_ground(i)) row.d(i) += place.ground;
  if (!force) return row;
  const Index n = motion.masses();
  const double inertance = motion.inertance_kg(place.element);
  for (Eigen::RowVectorXd* part : {&row.c, &row.d, &row.d_rate}) *part *= inertance;
  row.c.head(n) += slopes.sensed_stiffness.row(k).head(n);
  row.c.segment(n, n) += slopes.sensed_damping.row(k).head(n);
  row.c.tail(motion.memories()) += slopes.sensed_memory.row(k);
  for (Index i = 0; i < motion.inputs(); ++i) {
    if (motion.force_inside(i) == place.element) row.d(i) -= 1;
    const Index node = motion.input_node(i);
    if (node < 0) continue;
    row.d(i) += slopes.sensed_stiffness(k, node);
    row.d_rate(i) += slopes.sensed_damping(k, node);
  }
  return row;
}

}  // namespace

LinearPlant linearise(const Plant& plant, const Vector& state, const Vector& u) {
  const Motion motion(plant);
  const Index n = motion.masses(), m = motion.inputs(), s = motion.memories();
  Vector x = Vector::Zero(2 * n + s);
  if (state.size() == x.size() || state.size() == 2 * n) x.head(state.size()) = state;
  const Vector held = u.size() ? u : Vector::Zero(m);
  if ((state.size() && state.size() != x.size() && state.size() != 2 * n) || held.size() != m)
    throw UserError(fmt::format("linearise: expected a state of {} and inputs of {} numbers, found {} and {}", x.size(),
                                m, state.size(), held.size()));
  return linearise_along(plant, x, held);
}

LinearPlant linearise_along(const Plant& plant, ConstMatrixRef states, ConstMatrixRef u) {
  Motion motion(plant);
  const Index n = motion.masses(), m = motion.inputs(), p = motion.sensors(), s = motion.memories();
  if (states.rows() != 2 * n + s || u.rows() != m || states.cols() != u.cols() || states.cols() == 0)
    throw UserError(fmt::format("linearise: expected states of {} and inputs of {} numbers, found {} x {} and {} x {}",
                                2 * n + s, m, states.rows(), states.cols(), u.rows(), u.cols()));
  LinearPlant model;
  const Vector at_rest = Vector::Zero(m);
  Motion::Slopes slopes, own;
  for (Index k = 0; k < states.cols(); ++k) {
    const Vector x = states.col(k), held = u.col(k);
    motion.set_inputs(held.data(), at_rest.data());
    if (const int element = motion.slopes(x.data(), x.data() + n, x.data() + 2 * n, own); element >= 0) {
      model.status = Status::outside_domain;
      model.message = fmt::format("the operating point lies outside the domain of element \"{}\" (travel {:.6g} m)",
                                  plant.elements[static_cast<std::size_t>(element)].name, motion.travel(element));
      return model;
    }
    const double share = 1 / static_cast<double>(states.cols());
    const auto add = [&](Matrix& sum, const Matrix& part) {
      if (k == 0) sum = Matrix::Zero(part.rows(), part.cols());
      sum += share * part;
    };
    add(slopes.stiffness, own.stiffness);
    add(slopes.damping, own.damping);
    add(slopes.memory_force, own.memory_force);
    add(slopes.memory_travel, own.memory_travel);
    add(slopes.memory_rate, own.memory_rate);
    add(slopes.memory, own.memory);
    add(slopes.sensed_stiffness, own.sensed_stiffness);
    add(slopes.sensed_damping, own.sensed_damping);
    add(slopes.sensed_memory, own.sensed_memory);
  }
  const Matrix inverse_mass = motion.inverse_mass_matrix();

  model.A = Matrix::Zero(2 * n + s, 2 * n + s);
  model.A.block(0, n, n, n).setIdentity();
  model.A.block(n, 0, n, n) = -(inverse_mass * slopes.stiffness.topLeftCorner(n, n));
  model.A.block(n, n, n, n) = -(inverse_mass * slopes.damping.topLeftCorner(n, n));
  model.A.block(n, 2 * n, n, s) = inverse_mass * slopes.memory_force.topRows(n);
  model.A.block(2 * n, 0, s, n) = slopes.memory_travel.leftCols(n);
  model.A.block(2 * n, n, s, n) = slopes.memory_rate.leftCols(n);
  model.A.bottomRightCorner(s, s) = slopes.memory;
  model.B = Matrix::Zero(2 * n + s, m);
  model.B_rate = Matrix::Zero(2 * n + s, m);
  for (Index i = 0; i < m; ++i) {
    const Index node = motion.input_node(i);
    if (node >= 0) {
      model.B.col(i).segment(n, n) = -(inverse_mass * slopes.stiffness.col(node).head(n));
      model.B_rate.col(i).segment(n, n) = -(inverse_mass * slopes.damping.col(node).head(n));
      model.B.col(i).tail(s) = slopes.memory_travel.col(node);
      model.B_rate.col(i).tail(s) = slopes.memory_rate.col(node);
    } else {
      model.B.col(i).segment(n, n) = inverse_mass * motion.input_forces(i);
    }
  }
  model.C = Matrix::Zero(p, 2 * n + s);
  model.D = Matrix::Zero(p, m);
  model.D_rate = Matrix::Zero(p, m);
  for (Index k = 0; k < p; ++k) {
    const Row row = sensor_row(model, motion, slopes, k);
    model.C.row(k) = row.c;
    model.D.row(k) = row.d;
    model.D_rate.row(k) = row.d_rate;
  }
  if (model.A.size() == 0) return model;

  const ComplexVector poles = eigenvalues(model.A);
  const double growth = poles.real().maxCoeff();
  // A double pole at zero (a mass that may drift) splits by the square root of the round-off.
  if (growth > 1e-7 * poles.cwiseAbs().maxCoeff()) {
    model.status = Status::unstable;
    model.message = fmt::format("plant \"{}\" is unstable here: a pole at {:+.6g} 1/s", plant.name, growth);
  }
  return model;
}

std::vector<Mode> modes(ConstMatrixRef A) {
  std::vector<Mode> list;
  for (const std::complex<double>& pole : eigenvalues(A)) {
    if (pole.imag() < 0) continue;
    const double modulus = std::abs(pole);
    list.push_back({modulus / (2 * std::numbers::pi), modulus > 0 ? -pole.real() / modulus : 0, pole});
  }
  std::sort(list.begin(), list.end(), [](const Mode& a, const Mode& b) {
    return a.frequency_hz != b.frequency_hz ? a.frequency_hz < b.frequency_hz : a.damping_ratio < b.damping_ratio;
  });
  return list;
}

DiscreteInput discretise_zoh(ConstMatrixRef A, ConstMatrixRef B, double step_s) {
  const Index n = A.rows(), m = B.cols();
  Matrix joint = Matrix::Zero(n + m, n + m);
  joint.topLeftCorner(n, n) = A * step_s;
  joint.topRightCorner(n, m) = B * step_s;
  const Matrix exponential = matrix_exponential(joint);
  return {exponential.topLeftCorner(n, n), exponential.topRightCorner(n, m)};
}

}  // namespace wheelhop
