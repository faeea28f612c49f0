#include "core/plant/tangent.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace wheelhop {
namespace {

constexpr std::size_t kLanes = 4;  // doubles of a vector register: rows are padded to whole ones

using Size = std::size_t;

/// f(c) for whole registers that hold `count` numbers; what stands behind those in a row is never read.
template <class F>
void each(Size count, F f) {
  for (Size c = 0; c < count; c += kLanes)
    for (Size lane = 0; lane < kLanes; ++lane) f(c + lane);
}

/// y += factor * x, of different rows
void add(Size count, double factor, const double* __restrict x, double* __restrict y) {
  if (factor == 0) return;
  each(count, [&](Size c) { y[c] += factor * x[c]; });
}

/// y = x + factor * slope
void advance(Size count, const double* __restrict x, double factor, const double* __restrict slope,
             double* __restrict y) {
  each(count, [&](Size c) { y[c] = x[c] + factor * slope[c]; });
}

/// Changes of an element's travel and rate, of what its laws without memory make of them, and of its force in all.
struct ElementRows {
  double* __restrict travel;
  double* __restrict rate;
  double* __restrict force;
};
void respond(Size count, const Motion::ElementSlopes& slopes, const double* x0, const double* x1, const double* w0,
             const double* w1, const ElementRows& out) {
  each(count, [&](Size c) {
    out.travel[c] = x1[c] - x0[c];
    out.rate[c] = w1[c] - w0[c];
    out.force[c] += slopes.stiffness_n_per_m * out.travel[c] + slopes.damping_ns_per_m * out.rate[c];
  });
}

/// Law of an element's own numbers: what moves its force is df/dp (p' - p), where the law tells df/dp.
double along(const std::vector<double>& gradient, const Law& here, const Law& there) {
  double sum = 0;
  for (Size i = 0; i < gradient.size(); ++i) sum += gradient[i] * (there.values[i] - here.values[i]);
  return sum;
}

}  // namespace

Tangent::Tangent(const Plant& plant, const std::vector<Variation>& variations, Index kept_samples)
    : variations_(variations), masses_(static_cast<Size>(plant.mass_count())), active_(variations.size()) {
  const Motion motion(plant);
  memories_ = static_cast<Size>(motion.memories());
  stride_ = (active_ + kLanes - 1) / kLanes * kLanes;
  const auto rows = [&](Rows& r, Size count) { r.resize(static_cast<Index>(count), static_cast<Index>(stride_)); };
  const auto nodes = static_cast<Size>(motion.node_count());
  for (Rows* r : {&q_, &v_, &a_, &sum_q_, &sum_v_}) rows(*r, masses_);
  for (Rows* r : {&z_, &y_, &r_, &sum_z_, &own_rate_}) rows(*r, memories_);
  for (Rows* r : {&x_, &w_, &force_, &applied_}) rows(*r, nodes);
  for (Rows* r : {&travel_, &rate_, &free_rate_}) rows(*r, 1);
  rows(own_force_, plant.elements.size());
  elements_.resize(plant.elements.size());
  laws_.resize(static_cast<Size>(motion.memory_laws()));
  there_.resize(memories_);
  law_force_.resize(motion.laws_.size());
  gradients_.resize(motion.laws_.size());
  z_rate_.resize(memories_);
  defined.assign(active_, 1);
  outputs.assign(active_, Matrix::Zero(plant.sensor_count(), kept_samples));
  for (Size c = 0; c < active_; ++c) {
    const Variation& variation = variations_[c];
    if (variation.drive.size() > 0) driven_.push_back(c);
    for (Size i = 0; i < static_cast<Size>(variation.initial.size()); ++i) {
      Rows& to = i < masses_ ? q_ : i < 2 * masses_ ? v_ : z_;
      to.row(i < masses_       ? i
             : i < 2 * masses_ ? i - masses_
                               : i - 2 * masses_)[c] = variation.initial(static_cast<Index>(i));
    }
    if (!variation.neighbour) continue;
    const Plant& other = *variation.neighbour;
    Neighbour neighbour{c, Motion(other), {}, {}};
    for (Size i = 0; i < masses_; ++i)
      if (const double mass = plant.masses[i].mass_kg, moved = other.masses[i].mass_kg; mass != moved)
        neighbour.masses.push_back({i, (mass / moved - 1) / variation.step});
    for (Size b = 0; b < plant.elements.size(); ++b) {
      const Motion::Branch& branch = motion.branches_[b];
      const auto own_laws = [&](Size k) { return motion.laws_[k].values != neighbour.motion.laws_[k].values; };
      Changed changed{b, branch.modified, {}};
      bool any = false;
      for (Size k = 0; k < plant.elements[b].laws.size(); ++k)
        any = any || plant.elements[b].laws[k].values != other.elements[b].laws[k].values;
      for (Size k = branch.first_curved; k < branch.last_law; ++k)
        if (own_laws(k)) changed.laws.push_back(k);
      if (any) neighbour.elements.push_back(std::move(changed));
    }
    if (!neighbour.masses.empty() || !neighbour.elements.empty()) neighbours_.push_back(std::move(neighbour));
  }
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
          const auto neighbour =
              std::find_if(neighbours_.begin(), neighbours_.end(), [&](const auto& n) { return n.direction == c; });
          const Law& own = neighbour == neighbours_.end() ? motion.laws_[law] : neighbour->motion.laws_[law];
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

bool Tangent::law_force(const Motion& motion, Size law, double travel, double rate, double& f) {
  if (std::isnan(law_force_[law]) && !motion.laws_[law].force(travel, rate, law_force_[law])) return false;
  f = law_force_[law];
  return true;
}

bool Tangent::own_change(const Motion& motion, const Neighbour& neighbour, const Changed& changed, const double* z) {
  const Size b = changed.element, c = neighbour.direction;
  const Motion::Branch &here = motion.branches_[b], &there = neighbour.motion.branches_[b];
  const double travel = motion.x_[here.to] - motion.x_[here.from], rate = motion.v_[here.to] - motion.v_[here.from];
  const double free = motion.free_rate(here, rate), step = variations_[c].step;
  double sum = 0, own = 0, other = 0;
  if (changed.whole) {
    if (!neighbour.motion.element(there, travel, rate, free, z, other, z_rate_.data()) ||
        !motion.element(here, travel, rate, free, z, own, there_.data()))
      return false;
    sum = other - own;
    const Size last = b + 1 < motion.branches_.size() ? motion.branches_[b + 1].first_state : memories_;
    for (Size i = here.first_state; i < last; ++i) own_rate_.row(i)[c] = (z_rate_[i] - there_[i]) / step;
  } else {
    sum = (there.stiffness_n_per_m - here.stiffness_n_per_m) * travel +
          (there.damping_ns_per_m - here.damping_ns_per_m) * rate;
    for (const Size k : changed.laws) {
      const Law &law = motion.laws_[k], &other_law = neighbour.motion.laws_[k];
      if (k < here.first_memory && law.kind->gradient) {
        std::vector<double>& gradient = gradients_[k];
        if (gradient.empty()) {
          gradient.resize(law.values.size());
          if (!law.kind->gradient(law.values, travel, rate, gradient.data())) return false;
        }
        sum += along(gradient, law, other_law);
        continue;
      }
      if (k < here.first_memory) {
        if (!law_force(motion, k, travel, rate, own) || !other_law.force(travel, rate, other)) return false;
      } else {
        const LawMemory& memory = law.kind->memory;
        Size state = here.first_state;
        for (Size m = here.first_memory; m < k; ++m) state += static_cast<Size>(motion.laws_[m].states());
        const double seen = memory.jump ? free : rate;
        if (!memory.force(law.values, travel, seen, z + state, own, there_.data()) ||
            !memory.force(other_law.values, travel, seen, z + state, other, z_rate_.data()))
          return false;
        for (Size i = 0; i < static_cast<Size>(memory.states); ++i)
          own_rate_.row(state + i)[c] = (z_rate_[i] - there_[i]) / step;
      }
      sum += other - own;
    }
  }
  own_force_.row(b)[c] = sum / step;
  return std::isfinite(sum);
}

void Tangent::own_changes(const Motion& motion, const double* z, const double* a) {
  own_force_.clear();
  own_rate_.clear();
  std::fill(law_force_.begin(), law_force_.end(), std::numeric_limits<double>::quiet_NaN());
  for (std::vector<double>& gradient : gradients_) gradient.clear();
  for (const Neighbour& neighbour : neighbours_) {
    const Size c = neighbour.direction;
    if (c >= active_ || !defined[c]) continue;
    for (const Changed& changed : neighbour.elements)
      if (!own_change(motion, neighbour, changed, z)) defined[c] = 0;
    for (const auto& [mass, share] : neighbour.masses) a_.row(mass)[c] += share * a[mass];
  }
}

int Tangent::evaluate(Motion& motion, const double* z, const double* a) {
  if (const int element = motion.slopes_here(z, elements_.data(), laws_.data()); element >= 0) return element;
  for (const Motion::RigidPoint& point : motion.points_) {
    std::fill_n(x_.row(point.node), active_, 0.0);
    std::fill_n(w_.row(point.node), active_, 0.0);
    for (const Motion::Weight& weight : point.weights) {
      add(active_, weight.value, x_.row(static_cast<Size>(weight.mass)), x_.row(point.node));
      add(active_, weight.value, w_.row(static_cast<Size>(weight.mass)), w_.row(point.node));
    }
  }
  a_.clear();
  own_changes(motion, z, a);
  force_ = applied_;
  double* const travel = travel_.row(0);
  double* const rate = rate_.row(0);
  double* const free = free_rate_.row(0);
  const MemorySlopes* law = laws_.data();
  for (Size b = 0; b < elements_.size(); ++b) {
    const Motion::Branch& branch = motion.branches_[b];
    const Motion::ElementSlopes& slopes = elements_[b];
    double* const sum = own_force_.row(b);
    respond(active_, slopes, x_.row(branch.from), x_.row(branch.to), w_.row(branch.from), w_.row(branch.to),
            {travel, rate, sum});
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
