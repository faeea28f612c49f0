#include "core/plant/motion.hpp"

#include <algorithm>
#include <cmath>

namespace wheelhop {

Motion::Motion(const Plant& plant) {
  for (const Mass& mass : plant.masses) {
    mass_.push_back(mass.mass_kg);
    inverse_mass_.push_back(1 / mass.mass_kg);
  }
  for (const Element& element : plant.elements) {
    Branch branch{};
    branch.from = static_cast<std::size_t>(plant.node(element.from));
    branch.to = static_cast<std::size_t>(plant.node(element.to));
    branch.first_law = laws_.size();
    laws_.insert(laws_.end(), element.laws.begin(), element.laws.end());
    branch.last_law = laws_.size();
    const auto first = laws_.begin() + static_cast<std::ptrdiff_t>(branch.first_law);
    const auto curved = std::stable_partition(first, laws_.end(), [](const Law& law) { return law.kind->is_linear; });
    branch.first_curved = static_cast<std::size_t>(curved - laws_.begin());
    for (auto law = first; law != curved; ++law) {
      double df_dx = 0, df_dv = 0;
      law->slopes(0, 0, df_dx, df_dv);
      branch.stiffness_n_per_m += df_dx;
      branch.damping_ns_per_m += df_dv;
    }
    branches_.push_back(branch);
  }
  for (const Point& point : plant.points) {
    RigidPoint rigid{static_cast<std::size_t>(plant.node(point.name)), {}};
    for (const auto& [mass, weight] : point.weights) rigid.weights.push_back({plant.node(mass), weight});
    points_.push_back(std::move(rigid));
  }
  for (const PlantInput& input : plant.inputs) {
    if (input.kind == InputKind::displacement)
      inputs_.push_back({plant.node(input.name), -1, -1});
    else
      inputs_.push_back({-1, plant.node(input.from), plant.node(input.to)});
  }
  for (const Sensor& sensor : plant.sensors)
    sensors_.push_back({sensor.kind, plant.node(sensor.from), plant.node(sensor.to)});
  const std::size_t nodes = plant.node_names().size();
  x_.assign(nodes, 0);
  v_.assign(nodes, 0);
  force_.assign(nodes, 0);
  applied_.assign(nodes, 0);
}

void Motion::set_inputs(const double* u, const double* u_rate) {
  std::fill(applied_.begin(), applied_.end(), 0.0);
  for (std::size_t i = 0; i < inputs_.size(); ++i) {
    const Drive& drive = inputs_[i];
    if (drive.node >= 0) {
      x_[static_cast<std::size_t>(drive.node)] = u[i];
      v_[static_cast<std::size_t>(drive.node)] = u_rate[i];
    } else {
      applied_[static_cast<std::size_t>(drive.from)] -= u[i];
      applied_[static_cast<std::size_t>(drive.to)] += u[i];
    }
  }
}

void Motion::load(const double* q, const double* v) {
  for (std::size_t i = 0; i < mass_.size(); ++i) {
    x_[i] = q[i];
    v_[i] = v[i];
  }
  for (const RigidPoint& point : points_) {
    double x = 0, rate = 0;
    for (const Weight& weight : point.weights) {
      x += weight.value * q[weight.mass];
      rate += weight.value * v[weight.mass];
    }
    x_[point.node] = x;
    v_[point.node] = rate;
  }
}

int Motion::accelerations(const double* q, const double* v, double* a) {
  load(q, v);
  for (std::size_t i = 0; i < force_.size(); ++i) force_[i] = applied_[i];
  for (std::size_t b = 0; b < branches_.size(); ++b) {
    const Branch& branch = branches_[b];
    const double travel = x_[branch.to] - x_[branch.from];
    const double rate = v_[branch.to] - v_[branch.from];
    double sum = branch.stiffness_n_per_m * travel + branch.damping_ns_per_m * rate;
    for (std::size_t k = branch.first_curved; k < branch.last_law; ++k) {
      double f;
      if (!laws_[k].force(travel, rate, f)) return static_cast<int>(b);
      sum += f;
    }
    if (!std::isfinite(sum)) return static_cast<int>(b);
    force_[branch.from] += sum;
    force_[branch.to] -= sum;
  }
  for (const RigidPoint& point : points_)
    for (const Weight& weight : point.weights)
      force_[static_cast<std::size_t>(weight.mass)] += weight.value * force_[point.node];
  for (std::size_t i = 0; i < mass_.size(); ++i) a[i] = force_[i] * inverse_mass_[i];
  return all_defined;
}

double Motion::reading(SensorKind kind, Index node, const double* q, const double* v, const double* a) const {
  const double* const own = kind == SensorKind::displacement ? q : kind == SensorKind::velocity ? v : a;
  if (node < masses()) return own[node];
  for (const RigidPoint& point : points_) {
    if (static_cast<Index>(point.node) != node) continue;
    double sum = 0;
    for (const Weight& weight : point.weights) sum += weight.value * own[weight.mass];
    return sum;
  }
  if (kind == SensorKind::displacement) return x_[static_cast<std::size_t>(node)];
  if (kind == SensorKind::velocity) return v_[static_cast<std::size_t>(node)];
  return 0;  // the ground; accelerometers stand on no drive
}

void Motion::outputs(const double* q, const double* v, const double* a, double* y) const {
  for (std::size_t i = 0; i < sensors_.size(); ++i) {
    const SensorPlace& sensor = sensors_[i];
    y[i] = reading(sensor.kind, sensor.to, q, v, a) - reading(sensor.kind, sensor.from, q, v, a);
  }
}

int Motion::slopes(const double* q, const double* v, Matrix& stiffness, Matrix& damping) {
  load(q, v);
  stiffness.setZero(node_count(), node_count());
  damping.setZero(node_count(), node_count());
  const auto add = [](Matrix& M, Index from, Index to, double slope) {
    M(from, from) += slope;
    M(to, to) += slope;
    M(from, to) -= slope;
    M(to, from) -= slope;
  };
  for (std::size_t b = 0; b < branches_.size(); ++b) {
    const Branch& branch = branches_[b];
    for (std::size_t k = branch.first_law; k < branch.last_law; ++k) {
      double df_dx, df_dv;
      if (!laws_[k].slopes(x_[branch.to] - x_[branch.from], v_[branch.to] - v_[branch.from], df_dx, df_dv) ||
          !std::isfinite(df_dx + df_dv))
        return static_cast<int>(b);
      add(stiffness, static_cast<Index>(branch.from), static_cast<Index>(branch.to), df_dx);
      add(damping, static_cast<Index>(branch.from), static_cast<Index>(branch.to), df_dv);
    }
  }
  for (const RigidPoint& point : points_) {
    const auto node = static_cast<Index>(point.node);
    for (Matrix* M : {&stiffness, &damping}) {
      for (const Weight& weight : point.weights) M->row(weight.mass) += weight.value * M->row(node);
      M->row(node).setZero();
      for (const Weight& weight : point.weights) M->col(weight.mass) += weight.value * M->col(node);
      M->col(node).setZero();
    }
  }
  return all_defined;
}

Motion::Energy Motion::energy(const double* q, const double* v) {
  load(q, v);
  Energy result;
  for (std::size_t i = 0; i < mass_.size(); ++i) result.kinetic_j += 0.5 * mass_[i] * v[i] * v[i];
  // Reaction to the part of each element's force that is not the gradient of its energy, gathered at the nodes.
  std::fill(force_.begin(), force_.end(), 0.0);
  for (std::size_t b = 0; b < branches_.size(); ++b) {
    const Branch& branch = branches_[b];
    const double travel = x_[branch.to] - x_[branch.from];
    const double rate = v_[branch.to] - v_[branch.from];
    for (std::size_t k = branch.first_law; k < branch.last_law; ++k) {
      double moving, still;
      if (!laws_[k].force(travel, rate, moving) || !laws_[k].force(travel, 0, still)) {
        result.undefined_element = static_cast<int>(b);
        return result;
      }
      result.potential_j += laws_[k].energy(travel);
      result.dissipated_w += laws_[k].dissipation(travel, rate);
      force_[branch.from] += moving - still;
      force_[branch.to] -= moving - still;
    }
  }
  for (std::size_t i = 0; i < inputs_.size(); ++i) {
    const Drive& drive = inputs_[i];
    if (drive.node < 0) continue;
    const auto node = static_cast<std::size_t>(drive.node);
    result.input_w -= force_[node] * v_[node];
  }
  for (std::size_t node = 0; node < x_.size(); ++node) result.input_w += applied_[node] * v_[node];
  return result;
}

std::vector<Motion::Weight> Motion::weights(Index node) const {
  if (node < masses()) return {{node, 1.0}};
  for (const RigidPoint& point : points_)
    if (static_cast<Index>(point.node) == node) return point.weights;
  return {};
}

double Motion::travel(int element) const {
  const Branch& branch = branches_[static_cast<std::size_t>(element)];
  return x_[branch.to] - x_[branch.from];
}

std::array<Index, 2> Motion::force_nodes(Index input) const {
  const Drive& drive = inputs_[static_cast<std::size_t>(input)];
  return {drive.from, drive.to};
}

}  // namespace wheelhop
