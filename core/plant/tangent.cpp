#include "core/plant/tangent.hpp"

#include <algorithm>
#include <cmath>

namespace wheelhop {
namespace {

constexpr std::size_t kLanes = 4;  // doubles of a vector register: rows are padded to whole ones

using Size = std::size_t;

/// What holds `count` numbers in whole registers; what stands behind them in a row is never read.
Size filled(Size count) { return (count + kLanes - 1) / kLanes * kLanes; }

/// y += factor * x, of different rows
void add(Size count, double factor, const double* x, double* y) {
  if (factor == 0) return;
  const Size n = filled(count);
#pragma GCC ivdep
  for (Size c = 0; c < n; ++c) y[c] += factor * x[c];
}

/// y = x + factor * slope
void advance(Size count, const double* x, double factor, const double* slope, double* y) {
  const Size n = filled(count);
#pragma GCC ivdep
  for (Size c = 0; c < n; ++c) y[c] = x[c] + factor * slope[c];
}

/// Changes of an element's travel and rate between its ends, and what its laws without memory add to its force.
void respond(Size count, const Motion::ElementSlopes& slopes, const double* x0, const double* x1, const double* w0,
             const double* w1, double* travel, double* rate, double* force) {
  const double stiffness = slopes.stiffness_n_per_m, damping = slopes.damping_ns_per_m;
  const Size n = filled(count);
#pragma GCC ivdep
  for (Size c = 0; c < n; ++c) {
    const double dx = x1[c] - x0[c], dv = w1[c] - w0[c];
    travel[c] = dx;
    rate[c] = dv;
    force[c] += stiffness * dx + damping * dv;
  }
}

}  // namespace

Tangent::Tangent(const Plant& plant, const std::vector<Variation>& variations, Index kept_samples)
    : variations_(variations), masses_(static_cast<Size>(plant.mass_count())), active_(variations.size()) {
  const Motion motion(plant);
  memories_ = static_cast<Size>(motion.memories());
  stride_ = filled(active_);
  const auto rows = [&](Rows& r, Size count) { r.resize(static_cast<Index>(count), static_cast<Index>(stride_)); };
  const auto nodes = static_cast<Size>(motion.node_count());
  for (Rows* r : {&q_, &v_, &a_, &sum_q_, &sum_v_}) rows(*r, masses_);
  for (Rows* r : {&z_, &y_, &r_, &sum_z_, &own_rate_}) rows(*r, memories_);
  for (Rows* r : {&x_, &w_, &force_, &applied_}) rows(*r, nodes);
  for (Rows* r : {&travel_, &rate_, &free_rate_}) rows(*r, 1);
  rows(own_force_, plant.elements.size());
  elements_.resize(plant.elements.size());
  laws_.resize(static_cast<Size>(motion.memory_laws()));
  here_.resize(memories_);
  there_.resize(memories_);
  for (const Law& law : motion.laws_) gradients_.emplace_back(law.values.size());
  known_.resize(motion.laws_.size());
  neighbour_of_.assign(active_, active_);
  defined.assign(active_, 1);
  outputs.assign(active_, Matrix::Zero(plant.sensor_count(), kept_samples));
  for (Size c = 0; c < active_; ++c) {
    const Variation& variation = variations_[c];
    if (variation.drive.size() > 0) driven_.push_back(c);
    if (variation.neighbour) add_neighbour(plant, motion, c);
    if (variation.initial.size() == 0) continue;
    const double* const initial = variation.initial.data();
    for (Size i = 0; i < masses_; ++i) {
      q_.row(i)[c] = initial[i];
      v_.row(i)[c] = initial[masses_ + i];
    }
    const Size known = static_cast<Size>(variation.initial.size()) - 2 * masses_;
    for (Size i = 0; i < known; ++i) z_.row(i)[c] = initial[2 * masses_ + i];
  }
}

void Tangent::add_neighbour(const Plant& plant, const Motion& motion, Size direction) {
  const Plant& other = *variations_[direction].neighbour;
  const double step = variations_[direction].step;
  for (Size i = 0; i < masses_; ++i)
    if (const double mass = plant.masses[i].mass_kg, moved = other.masses[i].mass_kg; mass != moved)
      own_masses_.push_back({direction, i, (mass / moved - 1) / step});
  Motion there(other);
  const Size before = changes_.size();
  for (Size b = 0; b < plant.elements.size(); ++b) {
    const Motion::Branch &branch = motion.branches_[b], &moved = there.branches_[b];
    const auto same_values = [](const Law& one, const Law& another) { return one.values == another.values; };
    if (std::equal(plant.elements[b].laws.begin(), plant.elements[b].laws.end(), other.elements[b].laws.begin(),
                   same_values))
      continue;
    if (branch.modified) {  // a contact or clearance bounds what the laws do together
      changes_.push_back({direction, b, OwnChange::whole});
      continue;
    }
    const double stiffness = moved.stiffness_n_per_m - branch.stiffness_n_per_m,
                 damping = moved.damping_ns_per_m - branch.damping_ns_per_m;
    if (stiffness != 0 || damping != 0)
      changes_.push_back({direction, b, OwnChange::linear, stiffness / step, damping / step});
    Size state = branch.first_state;
    for (Size k = branch.first_curved; k < branch.last_law; ++k) {
      const Law &law = motion.laws_[k], &moved_law = there.laws_[k];
      if (!same_values(law, moved_law)) {
        OwnChange own{direction, b, k >= branch.first_memory ? OwnChange::memory : OwnChange::law, 0, 0, k, state};
        if (law.kind->gradient && own.by == OwnChange::law) {
          own.by = OwnChange::gradient;
          for (Size i = 0; i < law.values.size(); ++i)  // infinite in both where a key is absent
            own.values.push_back(law.values[i] == moved_law.values[i] ? 0
                                                                      : (moved_law.values[i] - law.values[i]) / step);
        }
        changes_.push_back(std::move(own));
      }
      if (k >= branch.first_memory) state += static_cast<Size>(law.states());
    }
  }
  if (changes_.size() == before) return;
  neighbour_of_[direction] = neighbours_.size();
  neighbours_.push_back(std::move(there));
}

void Tangent::step_memories(const Motion& motion, Index k, const double* step, const double* z) {
  for (const Motion::Branch& branch : motion.branches_) {
    if (branch.driven < 0) continue;
    Size state = branch.first_state;
    for (Size law = branch.first_memory; law < branch.last_law; ++law) {
      const LawMemory& memory = motion.laws_[law].kind->memory;
      const auto states = static_cast<Size>(memory.states);
      if (memory.jump) {
        double after[max_law_states], there[max_law_states];
        std::copy_n(z + state, states, after);
        memory.jump(motion.laws_[law].values, branch.driven_sign * step[branch.driven], after);
        for (Size c = 0; c < active_; ++c) {
          const Variation& variation = variations_[c];
          const Size neighbour = neighbour_of_[c];
          const Law& own = (neighbour < neighbours_.size() ? neighbours_[neighbour] : motion).laws_[law];
          double change = 0;
          if (variation.drive.size() > 0 && k > 0)
            change = variation.drive(branch.driven, k) - variation.drive(branch.driven, k - 1);
          for (Size i = 0; i < states; ++i) there[i] = z[state + i] + variation.step * z_.row(state + i)[c];
          memory.jump(own.values, branch.driven_sign * (step[branch.driven] + variation.step * change), there);
          for (Size i = 0; i < states; ++i) z_.row(state + i)[c] = (there[i] - after[i]) / variation.step;
        }
      }
      state += states;
    }
  }
}

void Tangent::set_inputs(const Motion& motion, Index k, bool sampled, double hold_s) {
  if (driven_.empty()) return;
  applied_.clear();
  for (Size i = 0; i < motion.inputs_.size(); ++i) {
    const Motion::Drive& input = motion.inputs_[i];
    for (const Size c : driven_) {
      const Matrix& drive = variations_[c].drive;
      const auto at = static_cast<Index>(i);
      const double change = sampled && variations_[c].sampled.size() > 0 ? variations_[c].sampled(at, k) : drive(at, k);
      if (input.node >= 0) {
        x_.row(static_cast<Size>(input.node))[c] = change;
        w_.row(static_cast<Size>(input.node))[c] = k > 0 ? (drive(at, k) - drive(at, k - 1)) / hold_s : 0;
      } else {
        applied_.row(static_cast<Size>(input.from))[c] -= change;
        applied_.row(static_cast<Size>(input.to))[c] += change;
      }
    }
  }
}

bool Tangent::own_change(const Motion& motion, const OwnChange& own, const double* z) {
  const Size b = own.element, c = own.direction;
  const Motion::Branch& branch = motion.branches_[b];
  const double travel = motion.x_[branch.to] - motion.x_[branch.from];
  const double rate = motion.v_[branch.to] - motion.v_[branch.from];
  double& force = own_force_.row(b)[c];
  if (own.by == OwnChange::linear) {
    force += own.stiffness_n_per_m * travel + own.damping_ns_per_m * rate;
    return true;
  }
  const Law& law = motion.laws_[own.which];
  if (own.by == OwnChange::gradient) {
    std::vector<double>& gradient = gradients_[own.which];
    if (!known_[own.which] && !law.kind->gradient(law.values, travel, rate, gradient.data())) return false;
    known_[own.which] = 1;
    for (Size i = 0; i < gradient.size(); ++i)
      if (own.values[i] != 0) force += gradient[i] * own.values[i];
    return true;
  }
  const Motion& neighbour = neighbours_[neighbour_of_[c]];
  const Law& moved = neighbour.laws_[own.which];
  const double free = motion.free_rate(branch, rate), step = variations_[c].step;
  double here = 0, there = 0;
  if (own.by == OwnChange::law) {
    if (!law.force(travel, rate, here) || !moved.force(travel, rate, there)) return false;
    force += (there - here) / step;
    return true;
  }
  Size first = own.state, last = b + 1 < motion.branches_.size() ? motion.branches_[b + 1].first_state : memories_;
  if (own.by == OwnChange::memory) {
    const LawMemory& memory = law.kind->memory;
    const double seen = memory.jump ? free : rate;
    last = first + static_cast<Size>(memory.states);
    if (!memory.force(law.values, travel, seen, z + first, here, here_.data() + first) ||
        !memory.force(moved.values, travel, seen, z + first, there, there_.data() + first))
      return false;
  } else {
    first = branch.first_state;
    if (!motion.element(branch, travel, rate, free, z, here, here_.data()) ||
        !neighbour.element(neighbour.branches_[b], travel, rate, free, z, there, there_.data()))
      return false;
  }
  force += (there - here) / step;
  for (Size i = first; i < last; ++i) own_rate_.row(i)[c] += (there_[i] - here_[i]) / step;
  return true;
}

void Tangent::own_changes(const Motion& motion, const double* z, const double* a) {
  a_.clear();
  own_force_.clear();
  own_rate_.clear();
  std::fill(known_.begin(), known_.end(), 0);
  for (const OwnChange& own : changes_)
    if (own.direction < active_ && defined[own.direction] && !own_change(motion, own, z)) defined[own.direction] = 0;
  for (const OwnMass& own : own_masses_)
    if (own.direction < active_) a_.row(own.mass)[own.direction] += own.share * a[own.mass];
}

int Tangent::evaluate(Motion& motion, const double* z, const double* a) {
  // First what is written number by number: vectors that read it at once would wait for it.
  own_changes(motion, z, a);
  if (const int element = motion.slopes_here(z, elements_.data(), laws_.data()); element >= 0) return element;
  for (const Motion::RigidPoint& point : motion.points_) {
    std::fill_n(x_.row(point.node), active_, 0.0);
    std::fill_n(w_.row(point.node), active_, 0.0);
    for (const Motion::Weight& weight : point.weights) {
      add(active_, weight.value, x_.row(static_cast<Size>(weight.mass)), x_.row(point.node));
      add(active_, weight.value, w_.row(static_cast<Size>(weight.mass)), w_.row(point.node));
    }
  }
  force_ = applied_;
  double* const travel = travel_.row(0);
  double* const rate = rate_.row(0);
  double* const free = free_rate_.row(0);
  const MemorySlopes* law = laws_.data();
  for (Size b = 0; b < elements_.size(); ++b) {
    const Motion::Branch& branch = motion.branches_[b];
    const Motion::ElementSlopes& slopes = elements_[b];
    double* const sum = own_force_.row(b);
    respond(active_, slopes, x_.row(branch.from), x_.row(branch.to), w_.row(branch.from), w_.row(branch.to), travel,
            rate, sum);
    Size state = branch.first_state;
    for (Size k = branch.first_memory; k < branch.last_law; ++k, ++law) {
      const LawMemory& memory = motion.laws_[k].kind->memory;
      const double* seen = rate;
      if (memory.jump && branch.driven >= 0) {
        const double* driven = w_.row(static_cast<Size>(motion.inputs_[static_cast<Size>(branch.driven)].node));
        advance(active_, rate, -branch.driven_sign, driven, free);
        seen = free;
      }
      add(active_, slopes.pulling * slopes.followed * law->df_dx, travel, sum);
      add(active_, slopes.pulling * law->df_dv, seen, sum);
      const auto states = static_cast<Size>(memory.states);
      for (Size i = 0; i < states; ++i) {
        add(active_, slopes.pulling * law->df_dz[i], y_.row(state + i), sum);
        double* const r = own_rate_.row(state + i);
        add(active_, slopes.followed * law->dz_dx[i], travel, r);
        add(active_, law->dz_dv[i], seen, r);
        for (Size j = 0; j < states; ++j) add(active_, law->dz_dz[max_law_states * i + j], y_.row(state + j), r);
      }
      state += states;
    }
    add(active_, 1, sum, force_.row(branch.from));
    add(active_, -1, sum, force_.row(branch.to));
  }
  std::swap(r_, own_rate_);
  for (const Motion::RigidPoint& point : motion.points_)
    for (const Motion::Weight& weight : point.weights)
      add(active_, weight.value, force_.row(point.node), force_.row(static_cast<Size>(weight.mass)));
  for (Size i = 0; i < masses_; ++i) add(active_, motion.inverse_mass_[i], force_.row(i), a_.row(i));
  return Motion::all_defined;
}

int Tangent::begin(Motion& motion, const double* z, const double* a) {
  for (Size i = 0; i < masses_; ++i) {
    std::copy_n(q_.row(i), active_, x_.row(i));
    std::copy_n(v_.row(i), active_, w_.row(i));
  }
  y_ = z_;
  if (const int element = evaluate(motion, z, a); element >= 0) return element;
  sum_q_ = v_;
  sum_v_ = a_;
  sum_z_ = r_;
  return Motion::all_defined;
}

int Tangent::stage(double c, double weight, Motion& motion, const double* z, const double* a) {
  for (Size i = 0; i < masses_; ++i) {
    advance(active_, q_.row(i), c, w_.row(i), x_.row(i));
    advance(active_, v_.row(i), c, a_.row(i), w_.row(i));
    add(active_, weight, w_.row(i), sum_q_.row(i));
  }
  for (Size i = 0; i < memories_; ++i) advance(active_, z_.row(i), c, r_.row(i), y_.row(i));
  if (const int element = evaluate(motion, z, a); element >= 0) return element;
  for (Size i = 0; i < masses_; ++i) add(active_, weight, a_.row(i), sum_v_.row(i));
  for (Size i = 0; i < memories_; ++i) add(active_, weight, r_.row(i), sum_z_.row(i));
  return Motion::all_defined;
}

void Tangent::finish(double h) {
  for (Size i = 0; i < masses_; ++i) {
    add(active_, h / 6, sum_q_.row(i), q_.row(i));
    add(active_, h / 6, sum_v_.row(i), v_.row(i));
  }
  for (Size i = 0; i < memories_; ++i) add(active_, h / 6, sum_z_.row(i), z_.row(i));
}

void Tangent::read(const Motion& motion, Index column) {
  // Changes of one node's motion of the kind that a sensor reads, added to its readings.
  const auto add_reading = [&](SensorKind kind, Index node, double sign, Index sensor) {
    const auto at = static_cast<Size>(node);
    const auto add_row = [&](const double* row, double factor) {
      for (Size c = 0; c < active_; ++c) outputs[c](sensor, column) += factor * row[c];
    };
    if (kind == SensorKind::displacement) return add_row(x_.row(at), sign);
    if (kind == SensorKind::velocity) return add_row(w_.row(at), sign);
    if (at < masses_) return add_row(a_.row(at), sign);
    for (const Motion::RigidPoint& point : motion.points_)
      if (point.node == at)
        for (const Motion::Weight& weight : point.weights)
          add_row(a_.row(static_cast<Size>(weight.mass)), sign * weight.value);
  };
  for (Size i = 0; i < motion.sensors_.size(); ++i) {
    const Motion::SensorPlace& sensor = motion.sensors_[i];
    add_reading(sensor.kind, sensor.to, 1, static_cast<Index>(i));
    add_reading(sensor.kind, sensor.from, -1, static_cast<Index>(i));
  }
  const auto faded = [&](const Variation& v) { return v.kept_samples >= 0 && v.kept_samples <= column + 1; };
  while (active_ > 0 && faded(variations_[active_ - 1])) --active_;
}

}  // namespace wheelhop
