#include "core/plant/motion.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "core/plant/schedule.hpp"

namespace wheelhop {

Motion::Motion(const Plant& plant) {
  held_ = plant.held();
  bool inerters = false;
  for (const Mass& mass : plant.masses) {
    mass_.push_back(mass.mass_kg);
    inverse_mass_.push_back(1 / mass.mass_kg);
  }
  for (const Element& element : plant.elements) {
    Branch branch{};
    branch.from = static_cast<std::size_t>(plant.node(element.from));
    branch.to = static_cast<std::size_t>(plant.node(element.to));
    branch.first_law = laws_.size();
    branch.contact_n = std::numeric_limits<double>::infinity();
    for (const Law& law : element.laws) {
      // Its functions read all of them.
      if (law.values.size() < law.kind->parameters.size())
        throw std::logic_error(fmt::format("element \"{}\": law \"{}\": expected {} values, found {}", element.name,
                                           law.kind->name, law.kind->parameters.size(), law.values.size()));
      switch (law.kind->role) {
        case LawRole::force: laws_.push_back(law); continue;
        case LawRole::inertance:
          branch.inertance_kg += law.values[0];
          inerters = true;
          continue;
        case LawRole::play: branch.play_m += law.values[0]; break;
        case LawRole::contact: branch.contact_n = std::min(branch.contact_n, law.values[0]); break;
        case LawRole::offset: branch.offset_m += law.values[0]; break;
      }
      branch.modified = true;
    }
    branch.last_law = laws_.size();
    const auto first = laws_.begin() + static_cast<std::ptrdiff_t>(branch.first_law);
    const auto curved = std::stable_partition(first, laws_.end(),
                                              [](const Law& law) { return law.kind->is_linear && !law.scheduled(); });
    const auto memory = std::stable_partition(curved, laws_.end(), [](const Law& law) { return law.states() == 0; });
    branch.first_curved = static_cast<std::size_t>(curved - laws_.begin());
    branch.first_memory = static_cast<std::size_t>(memory - laws_.begin());
    branch.first_state = rest_.size();
    for (auto law = memory; law != laws_.end(); ++law)
      rest_.resize(rest_.size() + static_cast<std::size_t>(law->states()));
    for (auto law = first; law != curved; ++law) {
      double df_dx = 0, df_dv = 0;
      law->slopes(0, 0, df_dx, df_dv);
      branch.stiffness_n_per_m += df_dx;
      branch.damping_ns_per_m += df_dv;
    }
    if (branch.offset_m != 0) {
      double rest = 0, f = 0;
      for (auto law = first; law != memory; ++law)  // memories give no force at rest
        rest += law->force(branch.offset_m, 0, f) ? f : std::numeric_limits<double>::quiet_NaN();
      branch.rest_force_n = rest;
    }
    branches_.push_back(branch);
  }
  for (const Point& point : plant.points) {
    RigidPoint rigid{static_cast<std::size_t>(plant.node(point.name)), {}};
    for (const auto& [mass, weight] : point.weights) rigid.weights.push_back({plant.node(mass), weight});
    points_.push_back(std::move(rigid));
  }
  for (const PlantInput& input : plant.inputs) {
    switch (input.kind) {
      case InputKind::displacement: inputs_.push_back({plant.node(input.name), -1, -1}); break;
      case InputKind::force:
        inputs_.push_back({-1, plant.node(input.from), plant.node(input.to),
                           input.inside.empty() ? -1 : plant.element(input.inside)});
        break;
      case InputKind::acceleration: inputs_.push_back({-1, -1, -1, -1, true}); break;
      case InputKind::schedule: inputs_.push_back({-1, -1, -1}); break;
    }
  }
  for (std::size_t k = 0; k < laws_.size(); ++k)
    for (std::size_t i = 0; i < plant.inputs.size(); ++i)
      if (const Schedule& schedule = laws_[k].schedule; schedule.by == plant.inputs[i].name)
        for (const auto& [value, slope] : schedule.slopes)
          scheduled_.push_back({k, value, i, laws_[k].values[value], slope, plant.inputs[i].range});
  for (Branch& branch : branches_) {
    branch.driven = branch.driven_too = -1;
    for (std::size_t i = 0; i < inputs_.size(); ++i) {
      if (inputs_[i].node < 0) continue;
      const auto node = static_cast<std::size_t>(inputs_[i].node);
      if (node != branch.from && node != branch.to) continue;
      if (branch.driven >= 0) {
        branch.driven_too = static_cast<int>(i);
        continue;
      }
      branch.driven = static_cast<int>(i);
      branch.driven_sign = node == branch.to ? 1 : -1;
    }
  }
  for (const Sensor& sensor : plant.sensors) {
    if (sensor.kind != SensorKind::force) {
      sensors_.push_back({sensor.kind, plant.node(sensor.from), plant.node(sensor.to)});
      continue;
    }
    const Index element = plant.element(sensor.element);
    const Branch& branch = branches_[static_cast<std::size_t>(element)];
    sensors_.push_back({sensor.kind, static_cast<Index>(branch.from), static_cast<Index>(branch.to), element});
  }
  const std::size_t nodes = plant.node_names().size();
  weights_.resize(nodes);
  for (std::size_t i = 0; i < mass_.size(); ++i) weights_[i] = {{static_cast<Index>(i), 1.0}};
  for (const RigidPoint& point : points_) weights_[point.node] = point.weights;
  // The ground carries every place, but turns no mass.
  for (const Mass& mass : plant.masses) carried_.push_back(turns(plant, mass.name) ? 0 : 1);
  const auto carried = [&](Index node) {
    return node < masses() ? carried_[static_cast<std::size_t>(node)] : weights(node).empty() ? 0 : 1;
  };
  for (SensorPlace& sensor : sensors_)
    if (sensor.kind == SensorKind::acceleration) sensor.ground = carried(sensor.to) - carried(sensor.from);
  if (inerters) couple();
  z_rate_.assign(rest_.size(), 0);
  element_force_.assign(branches_.size(), 0);
  x_.assign(nodes, 0);
  v_.assign(nodes, 0);
  force_.assign(nodes, 0);
  loads_.assign(nodes, 0);
  for (const Load& load : plant.loads) loads_[static_cast<std::size_t>(plant.node(load.on))] += load.force_n;
  applied_ = loads_;
  inside_.assign(branches_.size(), 0);
}

Vector Motion::load_forces() const {
  Vector forces = Vector::Zero(masses());
  for (std::size_t node = 0; node < loads_.size(); ++node)
    for (const Weight& weight : weights_[node]) forces(weight.mass) += weight.value * loads_[node];
  return forces;
}

Matrix Motion::mass_matrix() const {
  const Index n = masses();
  Matrix M = Matrix::Zero(n, n);
  for (Index i = 0; i < n; ++i) M(i, i) = mass_kg(i);
  for (const Branch& branch : branches_) {
    if (branch.inertance_kg == 0) continue;
    Vector g = Vector::Zero(n);
    for (const Weight& weight : weights(static_cast<Index>(branch.to))) g(weight.mass) += weight.value;
    for (const Weight& weight : weights(static_cast<Index>(branch.from))) g(weight.mass) -= weight.value;
    M += branch.inertance_kg * g * g.transpose();
  }
  return M;
}

Matrix Motion::inverse_mass_matrix() const {
  const Index n = masses();
  Matrix inverse = Matrix::Zero(n, n);
  for (Index i = 0; i < n; ++i)
    for (Index j = 0; j < n; ++j)
      if (coupled() || i == j)
        inverse(i, j) = coupled() ? inverse_matrix_[static_cast<std::size_t>(n * i + j)]
                                  : inverse_mass_[static_cast<std::size_t>(i)];
  return inverse;
}

void Motion::couple() {
  const Index n = masses();
  const Matrix inverse = Eigen::LLT<Matrix>(mass_matrix()).solve(Matrix::Identity(n, n));
  inverse_matrix_.resize(static_cast<std::size_t>(n * n));
  for (Index i = 0; i < n; ++i)
    for (Index j = 0; j < n; ++j) inverse_matrix_[static_cast<std::size_t>(n * i + j)] = inverse(i, j);
}

void Motion::set_inputs(const double* u, const double* u_rate) {
  applied_ = loads_;
  std::fill(inside_.begin(), inside_.end(), 0.0);
  for (std::size_t i = 0; i < inputs_.size(); ++i) {
    const Drive& drive = inputs_[i];
    if (drive.node >= 0) {
      x_[static_cast<std::size_t>(drive.node)] = u[i];
      v_[static_cast<std::size_t>(drive.node)] = u_rate[i];
    } else if (drive.accelerates_ground) {
      ground_acceleration_ = u[i];
      for (std::size_t mass = 0; mass < mass_.size(); ++mass) applied_[mass] -= carried_[mass] * mass_[mass] * u[i];
    } else if (drive.pushes()) {
      applied_[static_cast<std::size_t>(drive.from)] -= u[i];
      applied_[static_cast<std::size_t>(drive.to)] += u[i];
      if (drive.inside >= 0) inside_[static_cast<std::size_t>(drive.inside)] -= u[i];
    }
  }
  set_schedules(u);
}

void Motion::set_schedules(const double* u) {
  if (!scheduled_.empty()) schedules_.assign(u, u + inputs_.size());
  for (const Scheduled& own : scheduled_)
    laws_[own.law].values[own.value] = own.at_zero + own.slope * within_range(own.range, u[own.input]);
}

void Motion::place(const double* q, const double* v) {
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

bool Motion::has_play() const {
  return std::any_of(branches_.begin(), branches_.end(), [](const Branch& branch) { return branch.play_m > 0; });
}

double Motion::effective_travel(const Branch& branch, double travel) const {
  if (!branch.modified) return travel;
  return travel - (1 - play_leak_) * std::clamp(travel, -branch.play_m, branch.play_m) + branch.offset_m;
}

double Motion::free_rate(const Branch& branch, double rate) const {
  if (branch.driven < 0 || !held_) return rate;
  const auto speed = [&](int input) {
    return v_[static_cast<std::size_t>(inputs_[static_cast<std::size_t>(input)].node)];
  };
  const double other = branch.driven_too >= 0 ? speed(branch.driven_too) : 0;
  return rate - branch.driven_sign * (speed(branch.driven) - other);
}

void Motion::step_memories(const double* step, double* z) const {
  for (const Branch& branch : branches_) {
    if (branch.driven < 0) continue;
    std::size_t state = branch.first_state;
    for (std::size_t k = branch.first_memory; k < branch.last_law; ++k) {
      const LawMemory& memory = laws_[k].kind->memory;
      if (memory.jump) memory.jump(laws_[k].values, driven_by(branch, step), z + state);
      state += static_cast<std::size_t>(memory.states);
    }
  }
}

// Sum of the laws of an element at its effective travel, before a contact bounds it.
/// @param free_rate without the velocity of a drive, for laws that know its steps
inline bool Motion::force(const Branch& branch, double travel, double rate, double free_rate, const double* z,
                          double& sum, double* z_rate) const {
  sum = branch.stiffness_n_per_m * travel + branch.damping_ns_per_m * rate;
  double f;
  for (std::size_t k = branch.first_curved; k < branch.first_memory; ++k) {
    if (!laws_[k].force(travel, rate, f)) return false;
    sum += f;
  }
  std::size_t state = branch.first_state;
  for (std::size_t k = branch.first_memory; k < branch.last_law; ++k) {
    const LawMemory& memory = laws_[k].kind->memory;
    if (!memory.force(laws_[k].values, travel, memory.jump ? free_rate : rate, z + state, f, z_rate + state))
      return false;
    sum += f;
    state += static_cast<std::size_t>(memory.states);
  }
  return true;
}

// The force of an element and the rates of its memories, clearance and contact included. False where undefined.
bool Motion::element(const Branch& branch, double own_travel, double rate, double free_rate, const double* z,
                     double& sum, double* z_rate) const {
  if (!force(branch, effective_travel(branch, own_travel), rate, free_rate, z, sum, z_rate) || !std::isfinite(sum))
    return false;
  if (branch.modified) sum = std::min(sum - branch.rest_force_n, branch.contact_n);
  return true;
}

double Motion::fastest_yielding() const {
  double fastest = 0;
  for (const Branch& branch : branches_) {
    if (branch.first_memory == branch.last_law) continue;
    const double rate = v_[branch.to] - v_[branch.from];
    for (std::size_t k = branch.first_memory; k < branch.last_law; ++k) {
      const LawMemory& memory = laws_[k].kind->memory;
      fastest = std::max(fastest, decay(laws_[k], memory.jump ? free_rate(branch, rate) : rate));
    }
  }
  return fastest;
}

int Motion::accelerations(const double* q, const double* v, const double* z, double* a, double* z_rate) {
  place(q, v);
  for (std::size_t i = 0; i < force_.size(); ++i) force_[i] = applied_[i];
  for (std::size_t b = 0; b < branches_.size(); ++b) {
    const Branch& branch = branches_[b];
    const double rate = v_[branch.to] - v_[branch.from];
    double sum;
    if (!element(branch, x_[branch.to] - x_[branch.from], rate, free_rate(branch, rate), z, sum, z_rate))
      return static_cast<int>(b);
    element_force_[b] = sum;
    force_[branch.from] += sum;
    force_[branch.to] -= sum;
  }
  for (const RigidPoint& point : points_)
    for (const Weight& weight : point.weights)
      force_[static_cast<std::size_t>(weight.mass)] += weight.value * force_[point.node];
  for (std::size_t i = 0; i < mass_.size(); ++i) a[i] = accelerated(force_.data(), i);
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

// All that pulls the nodes of an element together: its laws, inerters among them, and inputs inside it.
double Motion::force_reading(std::size_t index, const double* q, const double* v, const double* z, const double* a) {
  const Branch& branch = branches_[index];
  const double rate = v_[branch.to] - v_[branch.from];
  double sum;
  if (!element(branch, x_[branch.to] - x_[branch.from], rate, free_rate(branch, rate), z, sum, z_rate_.data()))
    return std::numeric_limits<double>::quiet_NaN();
  if (branch.inertance_kg != 0) {
    const auto acceleration = [&](std::size_t node) {
      return reading(SensorKind::acceleration, static_cast<Index>(node), q, v, a);
    };
    sum += branch.inertance_kg * (acceleration(branch.to) - acceleration(branch.from));
  }
  return sum + inside_[index];
}

void Motion::outputs(const double* q, const double* v, const double* z, const double* a, double* y) {
  place(q, v);
  for (std::size_t i = 0; i < sensors_.size(); ++i) {
    const SensorPlace& sensor = sensors_[i];
    y[i] = sensor.kind == SensorKind::force
               ? force_reading(static_cast<std::size_t>(sensor.element), q, v, z, a)
               : reading(sensor.kind, sensor.to, q, v, a) - reading(sensor.kind, sensor.from, q, v, a) +
                     sensor.ground * ground_acceleration_;
  }
}

int Motion::slopes(const double* q, const double* v, Matrix& stiffness, Matrix& damping) {
  Slopes all;
  const int element = slopes(q, v, rest_.data(), all);
  stiffness = std::move(all.stiffness);
  damping = std::move(all.damping);
  return element;
}

bool Motion::slopes_of(std::size_t element, const double* z, ElementSlopes& s, MemorySlopes* laws) {
  const Branch& branch = branches_[element];
  const double own_travel = x_[branch.to] - x_[branch.from], rate = v_[branch.to] - v_[branch.from];
  const double travel = effective_travel(branch, own_travel);
  s.followed = branch.play_m > 0 && std::abs(own_travel) <= branch.play_m ? play_leak_ : 1;
  s.pulling = 1;
  if (std::isfinite(branch.contact_n)) {
    double sum = 0;
    if (!force(branch, travel, rate, free_rate(branch, rate), z, sum, z_rate_.data())) return false;
    if (sum - branch.rest_force_n > branch.contact_n) s.pulling = 0;
  }
  double stiffness = branch.stiffness_n_per_m, damping = branch.damping_ns_per_m;
  for (std::size_t k = branch.first_curved; k < branch.first_memory; ++k) {
    double df_dx, df_dv;
    if (!laws_[k].slopes(travel, rate, df_dx, df_dv) || !std::isfinite(df_dx + df_dv)) return false;
    stiffness += df_dx;
    damping += df_dv;
  }
  s.stiffness_n_per_m = s.pulling * s.followed * stiffness;
  s.damping_ns_per_m = s.pulling * damping;
  std::size_t state = branch.first_state;
  for (std::size_t k = branch.first_memory; k < branch.last_law; ++k) {
    const LawMemory& memory = laws_[k].kind->memory;
    *laws = {};
    const double seen = memory.jump ? free_rate(branch, rate) : rate;
    if (!memory.slopes(laws_[k].values, travel, seen, z + state, *laws++)) return false;
    state += static_cast<std::size_t>(memory.states);
  }
  return true;
}

int Motion::slopes_here(const double* z, ElementSlopes* elements, MemorySlopes* laws) {
  for (std::size_t b = 0; b < branches_.size(); ++b) {
    if (!slopes_of(b, z, elements[b], laws)) return static_cast<int>(b);
    laws += branches_[b].last_law - branches_[b].first_memory;
  }
  return all_defined;
}

Index Motion::memory_laws() const {
  Index count = 0;
  for (const Branch& branch : branches_) count += static_cast<Index>(branch.last_law - branch.first_memory);
  return count;
}

int Motion::slopes(const double* q, const double* v, const double* z, Slopes& result) {
  place(q, v);
  std::vector<ElementSlopes> elements(branches_.size());
  std::vector<MemorySlopes> laws(static_cast<std::size_t>(memory_laws()));
  if (const int element = slopes_here(z, elements.data(), laws.data()); element >= 0) return element;
  result.stiffness.setZero(node_count(), node_count());
  result.damping.setZero(node_count(), node_count());
  result.memory_force.setZero(node_count(), memories());
  result.memory_travel.setZero(memories(), node_count());
  result.memory_rate.setZero(memories(), node_count());
  result.memory.setZero(memories(), memories());
  result.sensed_stiffness.setZero(sensors(), node_count());
  result.sensed_damping.setZero(sensors(), node_count());
  result.sensed_memory.setZero(sensors(), memories());
  const auto add = [](Matrix& M, Index from, Index to, double slope) {
    M(from, from) += slope;
    M(to, to) += slope;
    M(from, to) -= slope;
    M(to, from) -= slope;
  };
  std::size_t law = 0;
  for (std::size_t b = 0; b < branches_.size(); ++b) {
    const Branch& branch = branches_[b];
    const auto from = static_cast<Index>(branch.from), to = static_cast<Index>(branch.to);
    const double pulling = elements[b].pulling, followed = elements[b].followed;
    add(result.stiffness, from, to, elements[b].stiffness_n_per_m);
    add(result.damping, from, to, elements[b].damping_ns_per_m);
    const auto sense = [&](Matrix& M, double slope) {
      for (Index row = 0; row < sensors(); ++row) {
        if (sensor(row).element != static_cast<Index>(b)) continue;
        M(row, to) += slope;
        M(row, from) -= slope;
      }
    };
    sense(result.sensed_stiffness, elements[b].stiffness_n_per_m);
    sense(result.sensed_damping, elements[b].damping_ns_per_m);
    auto state = static_cast<Index>(branch.first_state);
    for (std::size_t k = branch.first_memory; k < branch.last_law; ++k) {
      const MemorySlopes& s = laws[law++];
      add(result.stiffness, from, to, pulling * followed * s.df_dx);
      add(result.damping, from, to, pulling * s.df_dv);
      sense(result.sensed_stiffness, pulling * followed * s.df_dx);
      sense(result.sensed_damping, pulling * s.df_dv);
      const Index states = laws_[k].states();
      for (Index i = 0; i < states; ++i) {
        const auto at = static_cast<std::size_t>(i);
        result.memory_force(from, state + i) += pulling * s.df_dz[at];
        result.memory_force(to, state + i) -= pulling * s.df_dz[at];
        for (Index row = 0; row < sensors(); ++row)
          if (sensor(row).element == static_cast<Index>(b))
            result.sensed_memory(row, state + i) = pulling * s.df_dz[at];
        result.memory_travel(state + i, to) += followed * s.dz_dx[at];
        result.memory_travel(state + i, from) -= followed * s.dz_dx[at];
        result.memory_rate(state + i, to) += s.dz_dv[at];
        result.memory_rate(state + i, from) -= s.dz_dv[at];
        for (Index j = 0; j < states; ++j)
          result.memory(state + i, state + j) = s.dz_dz[static_cast<std::size_t>(max_law_states * i + j)];
      }
      state += states;
    }
  }
  for (const RigidPoint& point : points_) {
    const auto node = static_cast<Index>(point.node);
    for (Matrix* M : {&result.stiffness, &result.damping, &result.memory_force}) {
      for (const Weight& weight : point.weights) M->row(weight.mass) += weight.value * M->row(node);
      M->row(node).setZero();
    }
    for (Matrix* M : {&result.stiffness, &result.damping, &result.memory_travel, &result.memory_rate,
                      &result.sensed_stiffness, &result.sensed_damping}) {
      for (const Weight& weight : point.weights) M->col(weight.mass) += weight.value * M->col(node);
      M->col(node).setZero();
    }
  }
  return all_defined;
}

Motion::Energy Motion::energy(const double* q, const double* v, const double* z) {
  place(q, v);
  Energy result;
  for (std::size_t i = 0; i < mass_.size(); ++i) result.kinetic_j += 0.5 * mass_[i] * v[i] * v[i];
  for (const Branch& branch : branches_) {
    const double rate = v_[branch.to] - v_[branch.from];
    result.kinetic_j += 0.5 * branch.inertance_kg * rate * rate;
  }
  // Reaction to the part of each element's force that is not the gradient of its energy, gathered at the nodes.
  std::fill(force_.begin(), force_.end(), 0.0);
  for (std::size_t b = 0; b < branches_.size(); ++b) {
    const Branch& branch = branches_[b];
    const double travel = effective_travel(branch, x_[branch.to] - x_[branch.from]);
    const double rate = v_[branch.to] - v_[branch.from];
    double sum;
    if (!force(branch, travel, rate, free_rate(branch, rate), z, sum, z_rate_.data())) {
      result.undefined_element = static_cast<int>(b);
      return result;
    }
    sum -= branch.rest_force_n;
    double gradient = -branch.rest_force_n;  // the part of the force that comes from energy stored in the travel
    result.potential_j -= branch.rest_force_n * (travel - branch.offset_m);
    for (std::size_t k = branch.first_law; k < branch.first_memory; ++k) {
      double still;
      if (!laws_[k].force(travel, 0, still)) {
        result.undefined_element = static_cast<int>(b);
        return result;
      }
      gradient += still;
      result.potential_j += laws_[k].energy(travel);
      result.dissipated_w += laws_[k].dissipation(travel, rate);
    }
    std::size_t state = branch.first_state;
    for (std::size_t k = branch.first_memory; k < branch.last_law; ++k) {
      const LawMemory& memory = laws_[k].kind->memory;
      double own = 0;  // of a law that takes a drive's motion in steps: they change its energy, as a spring's
      if (memory.jump && branch.driven >= 0 &&
          memory.force(laws_[k].values, travel, rate, z + state, own, z_rate_.data() + state))
        gradient += own;
      if (memory.energy) result.potential_j += memory.energy(laws_[k].values, z + state);
      result.dissipated_w += memory.dissipation(laws_[k].values, travel, rate, z + state);
      state += static_cast<std::size_t>(memory.states);
    }
    const double lost = std::max(0.0, sum - branch.contact_n);
    result.dissipated_w -= lost * rate;
    force_[branch.from] += sum - gradient - lost;
    force_[branch.to] -= sum - gradient - lost;
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

double Motion::travel(int element) const {
  const Branch& branch = branches_[static_cast<std::size_t>(element)];
  return x_[branch.to] - x_[branch.from];
}

Vector Motion::input_forces(Index input) const {
  const Drive& drive = inputs_[static_cast<std::size_t>(input)];
  Vector forces = Vector::Zero(masses());
  if (drive.accelerates_ground) {
    for (Index i = 0; i < masses(); ++i) forces(i) = -carried_[static_cast<std::size_t>(i)] * mass_kg(i);
  } else if (drive.pushes()) {
    for (const Weight& weight : weights(drive.from)) forces(weight.mass) -= weight.value;
    for (const Weight& weight : weights(drive.to)) forces(weight.mass) += weight.value;
  }
  return forces;
}

}  // namespace wheelhop
