#include "core/plant/tangent.hpp"

#include "core/plant/drive_course.hpp"

#include <algorithm>
#include <cmath>

namespace wheelhop {

using Size = std::size_t;

Tangent::Tangent(const Plant& plant, const std::vector<Variation>& variations, Index kept_samples)
    : variations_(variations), masses_(static_cast<Size>(plant.mass_count())), active_(variations.size()) {
  Motion motion(plant);
  memories_ = static_cast<Size>(motion.memories());
  const Size n = masses_, size = 2 * n + memories_;
  elements_.resize(plant.elements.size());
  laws_.resize(static_cast<Size>(motion.memory_laws()));
  here_.resize(memories_);
  there_.resize(memories_);
  accelerations_.resize(n);
  scratch_.resize(3 * n + 2 * memories_ + 1);
  for (const Law& law : motion.laws_) gradients_.emplace_back(law.values.size());
  asked_.assign(motion.laws_.size(), 0);
  neighbour_of_.assign(active_, active_);
  defined.assign(active_, 1);
  outputs.assign(active_, Matrix::Zero(plant.sensor_count(), kept_samples));
  for (Rows* rows : {&state_, &stage_, &sum_}) rows->resize(size, active_);
  own_rate_.resize(memories_, active_);
  coupled_ = motion.coupled();
  shares_.resize(coupled_ ? n * n : n, active_);
  inputs_.resize(2 * motion.inputs_.size(), active_);
  applied_.resize(n, active_);
  loads_.resize(n, active_);
  ground_.resize(n, active_);
  Size memory_law = 0;
  int sensed = 0;
  for (Size b = 0; b < motion.branches_.size(); ++b) {
    const Motion::Branch& branch = motion.branches_[b];
    Part part{std::vector<double>(n),
              std::vector<double>(n),
              branch.driven,
              branch.driven_sign,
              branch.driven_too,
              -1,
              !branch.modified && branch.first_curved == branch.last_law,
              memory_law,
              {}};
    for (const Motion::Weight& weight : motion.weights(static_cast<Index>(branch.to)))
      part.g[static_cast<Size>(weight.mass)] += weight.value;
    for (const Motion::Weight& weight : motion.weights(static_cast<Index>(branch.from)))
      part.g[static_cast<Size>(weight.mass)] -= weight.value;
    for (Size i = 0; i < n; ++i) part.pull[i] = motion.accelerated(part.g.data(), i);
    const auto reads = [&](const Motion::SensorPlace& sensor) { return sensor.element == static_cast<Index>(b); };
    if (std::any_of(motion.sensors_.begin(), motion.sensors_.end(), reads)) part.sensed = sensed++;
    if (part.constant) elements_[b] = {branch.stiffness_n_per_m, branch.damping_ns_per_m, 1, 1};
    memory_law += branch.last_law - branch.first_memory;
    parts_.push_back(std::move(part));
  }
  for (Rows* rows : {&forces_, &inertances_}) rows->resize(static_cast<Size>(sensed), active_);
  for (Size c = 0; c < active_; ++c) {
    const Variation& variation = variations_[c];
    if (variation.drive.size() > 0) driven_.push_back(c);
    const bool follows = motion.has_schedules() && variation.drive.size() > 0;
    if (variation.neighbour || follows)
      add_neighbour(plant, variation.neighbour ? *variation.neighbour : plant, motion, c);
    for (Size i = 0; i < static_cast<Size>(variation.initial.size()); ++i)
      state_.set(i, c, variation.initial[static_cast<Index>(i)]);
  }
  applied_ = loads_;
  terms_.resize(term_values_.size(), active_);
  for (Size row = 0; row < term_values_.size(); ++row)
    for (Size c = 0; c < active_; ++c) terms_.set(row, c, term_values_[row][c]);
}

/// The row of a term of an element, which is added where it is the first of its kind.
Size Tangent::term_row(Size element, const Term& term) {
  std::vector<Term>& terms = parts_[element].terms;
  for (const Term& known : terms)
    if (known.by == term.by && known.law == term.law && known.value == term.value) return known.row;
  terms.push_back(term);
  terms.back().row = term_values_.size();
  term_values_.emplace_back(variations_.size(), 0.0);
  return terms.back().row;
}

void Tangent::add_neighbour(const Plant& plant, const Plant& other, const Motion& motion, Size direction) {
  const double step = variations_[direction].step;
  Motion there(other);
  if (!coupled_) {
    for (Size i = 0; i < masses_; ++i)
      if (const double mass = plant.masses[i].mass_kg, moved = other.masses[i].mass_kg; mass != moved) {
        shares_.set(i, direction, (mass / moved - 1) / step);
        masses_change_ = true;
      }
  } else if (const Matrix M = motion.mass_matrix(), moved = there.mass_matrix(); M != moved) {
    // The forces at a given motion stay: a changes from M^-1 f to M'^-1 f = M'^-1 M a.
    const Matrix shares = there.inverse_mass_matrix() * (M - moved) / step;
    for (Size i = 0; i < masses_; ++i)
      for (Size j = 0; j < masses_; ++j)
        shares_.set(masses_ * i + j, direction, shares(static_cast<Index>(i), static_cast<Index>(j)));
    masses_change_ = true;
  }
  for (Index input = 0; input < motion.inputs(); ++input) {
    if (!motion.accelerates_ground(input)) continue;
    const Vector change = (there.input_forces(input) - motion.input_forces(input)) / step;
    if ((change.array() == 0).all()) continue;
    ground_changes_ = true;
    // As a force on the masses that they have here.
    const Vector force = motion.mass_matrix() * (there.inverse_mass_matrix() * change);
    for (Size i = 0; i < masses_; ++i) ground_.set(i, direction, force(static_cast<Index>(i)));
  }
  if (const Vector change = (there.load_forces() - motion.load_forces()) / step; (change.array() != 0).any()) {
    loads_change_ = true;
    for (Size i = 0; i < masses_; ++i) loads_.set(i, direction, change(static_cast<Index>(i)));
  }
  const Size before = changes_.size();
  for (Size b = 0; b < plant.elements.size(); ++b) {
    const Motion::Branch &branch = motion.branches_[b], &moved = there.branches_[b];
    if (const int row = parts_[b].sensed; row >= 0)
      inertances_.set(static_cast<Size>(row), direction, (moved.inertance_kg - branch.inertance_kg) / step);
    const bool driven = variations_[direction].drive.size() > 0;
    const auto same_values = [driven](const Law& one, const Law& another) {
      return one.values == another.values && one.schedule.slopes == another.schedule.slopes &&
             !(driven && one.scheduled());
    };
    if (std::equal(plant.elements[b].laws.begin(), plant.elements[b].laws.end(), other.elements[b].laws.begin(),
                   same_values))
      continue;
    const auto put = [&](const Term& term, double value) { term_values_[term_row(b, term)][direction] = value; };
    if (branch.modified) {  // a contact or clearance bounds what the laws do together
      changes_.push_back({direction, b, OwnChange::whole, term_row(b, {Term::own, 0})});
      continue;
    }
    if (const double change = moved.stiffness_n_per_m - branch.stiffness_n_per_m; change != 0)
      put({Term::travel, 0}, change / step);
    if (const double change = moved.damping_ns_per_m - branch.damping_ns_per_m; change != 0)
      put({Term::rate, 0}, change / step);
    Size state = branch.first_state;
    for (Size k = branch.first_curved; k < branch.last_law; ++k) {
      const Law &law = motion.laws_[k], &moved_law = there.laws_[k];
      const bool remembers = k >= branch.first_memory;
      if (!same_values(law, moved_law)) {
        if (law.kind->gradient && !remembers && !law.scheduled()) {
          for (Size i = 0; i < law.values.size(); ++i)  // infinite in both where a key is absent
            if (law.values[i] != moved_law.values[i])
              put({Term::gradient, 0, k, i}, (moved_law.values[i] - law.values[i]) / step);
        } else {
          changes_.push_back(
              {direction, b, remembers ? OwnChange::memory : OwnChange::law, term_row(b, {Term::own, 0}), k, state});
        }
      }
      if (remembers) state += static_cast<Size>(law.states());
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
        const double driven = Motion::driven_by(branch, step);
        memory.jump(motion.laws_[law].values, driven, after);
        for (Size c = 0; c < active_; ++c) {
          const Variation& variation = variations_[c];
          const Size neighbour = neighbour_of_[c];
          const Law& own = (neighbour < neighbours_.size() ? neighbours_[neighbour] : motion).laws_[law];
          double change = 0;
          if (variation.drive.size() > 0 && k > 0)
            change = Motion::driven_by(branch, variation.drive.col(k).data()) -
                     Motion::driven_by(branch, variation.drive.col(k - 1).data());
          const Size row = 2 * masses_ + state;
          for (Size i = 0; i < states; ++i) there[i] = z[state + i] + variation.step * state_.get(row + i, c);
          memory.jump(own.values, driven + variation.step * change, there);
          for (Size i = 0; i < states; ++i) state_.set(row + i, c, (there[i] - after[i]) / variation.step);
        }
      }
      state += states;
    }
  }
}

Tangent::DriveChange Tangent::change_of_drive(const Motion& motion, const Variation& variation, Index input, Index k,
                                              bool sampled, double hold_s, double fraction) const {
  const Matrix& drive = variation.drive;
  if (!motion.held()) {
    const auto piece = smooth_piece([&](Index j) { return drive(input, j); }, k, drive.cols() - 1);
    return {piece.value(fraction), piece.slope(fraction) / hold_s};
  }
  return {sampled && variation.sampled.size() > 0 ? variation.sampled(input, k) : drive(input, k),
          k > 0 ? (drive(input, k) - drive(input, k - 1)) / hold_s : 0};
}

void Tangent::follow_schedules(const Motion& motion, Index k, bool sampled, double fraction) {
  for (Size c = 0; c < active_; ++c) {
    if (neighbour_of_[c] >= neighbours_.size()) continue;
    followed_ = motion.schedules_;
    if (const Variation& variation = variations_[c]; variation.drive.size() > 0)
      for (Size i = 0; i < followed_.size(); ++i)
        followed_[i] +=
            variation.step * change_of_drive(motion, variation, static_cast<Index>(i), k, sampled, 1, fraction).value;
    neighbours_[neighbour_of_[c]].set_schedules(followed_.data());
  }
}

void Tangent::set_inputs(const Motion& motion, Index k, bool sampled, double hold_s, double fraction) {
  if (motion.has_schedules() && !neighbours_.empty()) follow_schedules(motion, k, sampled, fraction);
  if (driven_.empty() && !ground_changes_) return;
  applied_ = loads_;
  if (ground_changes_)
    for (Size c = 0; c < active_; ++c)
      for (Size i = 0; i < masses_; ++i) applied_.add(i, c, ground_.get(i, c) * motion.ground_acceleration_);
  for (Size i = 0; i < motion.inputs_.size(); ++i) {
    const Motion::Drive& input = motion.inputs_[i];
    for (const Size c : driven_) {
      const auto [change, rate] =
          change_of_drive(motion, variations_[c], static_cast<Index>(i), k, sampled, hold_s, fraction);
      inputs_.set(2 * i, c, change);
      if (input.node >= 0) {
        inputs_.set(2 * i + 1, c, rate);
      } else if (input.accelerates_ground) {
        for (Size mass = 0; mass < masses_; ++mass)
          applied_.add(mass, c, -motion.carried_[mass] * motion.mass_[mass] * change);
      } else if (input.pushes()) {
        for (const Motion::Weight& weight : motion.weights(input.from))
          applied_.add(static_cast<Size>(weight.mass), c, -weight.value * change);
        for (const Motion::Weight& weight : motion.weights(input.to))
          applied_.add(static_cast<Size>(weight.mass), c, weight.value * change);
      }
    }
  }
}

bool Tangent::own_change(const Motion& motion, const OwnChange& own, const double* z) {
  const Size b = own.element, c = own.direction;
  const Motion::Branch& branch = motion.branches_[b];
  const double travel = motion.x_[branch.to] - motion.x_[branch.from];
  const double rate = motion.v_[branch.to] - motion.v_[branch.from];
  const Motion& neighbour = neighbours_[neighbour_of_[c]];
  const Law& law = motion.laws_[own.which];
  const Law& moved = neighbour.laws_[own.which];
  const double free = motion.free_rate(branch, rate), step = variations_[c].step;
  double here = 0, there = 0;
  if (own.by == OwnChange::law) {
    if (!law.force(travel, rate, here) || !moved.force(travel, rate, there)) return false;
    terms_.add(own.row, c, (there - here) / step);
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
  terms_.add(own.row, c, (there - here) / step);
  for (Size i = first; i < last; ++i) own_rate_.add(i, c, (there_[i] - here_[i]) / step);
  return true;
}

/// Slopes of the laws at the present motion, and what neighbours change there: numbers common to all directions, and
/// what is written direction by direction, well before vectors read it.
int Tangent::prepare_stage(Motion& motion, const double* z, const double* a) {
  std::copy_n(a, masses_, accelerations_.begin());
  for (const OwnChange& own : changes_) {
    terms_.set(own.row, own.direction, 0);
    for (Size i = 0; i < memories_; ++i) own_rate_.set(i, own.direction, 0);
  }
  for (const OwnChange& own : changes_)
    if (own.direction < active_ && defined[own.direction] && !own_change(motion, own, z)) defined[own.direction] = 0;
  for (Size b = 0; b < parts_.size(); ++b) {
    Part& part = parts_[b];
    if (!part.constant && !motion.slopes_of(b, z, elements_[b], laws_.data() + part.first_law_slopes))
      return static_cast<int>(b);
    const Motion::Branch& branch = motion.branches_[b];
    const double travel = motion.x_[branch.to] - motion.x_[branch.from];
    const double rate = motion.v_[branch.to] - motion.v_[branch.from];
    for (Term& term : part.terms) {
      if (term.by == Term::travel) term.factor = travel;
      if (term.by == Term::rate) term.factor = rate;
      if (term.by != Term::gradient) continue;
      const Law& law = motion.laws_[term.law];
      if (!asked_[term.law]) {
        if (!law.kind->gradient(law.values, travel, rate, gradients_[term.law].data())) return static_cast<int>(b);
        asked_[term.law] = 1;
      }
      term.factor = gradients_[term.law][term.value];
    }
    for (const Term& term : part.terms)
      if (term.by == Term::gradient) asked_[term.law] = 0;
  }
  return Motion::all_defined;
}

/// Accelerations and rates of the memories of four directions at their positions x, velocities w and memories y.
template <int N>
[[gnu::always_inline]] inline void Tangent::evaluate(const Motion& motion, Size four, const Lanes* x, const Lanes* w,
                                                     const Lanes* y, Lanes* a, Lanes* r) {
  const Size n = N > 0 ? N : masses_;
  if (masses_change_) {
    const Lanes* const share = shares_.block(four);
    if (coupled_) {
      for (Size i = 0; i < n; ++i) {
        a[i] = 0.0;
        for (Size j = 0; j < n; ++j) a[i] += share[n * i + j] * Lanes(accelerations_[j]);
      }
    } else {
      for (Size i = 0; i < n; ++i) a[i] = share[i] * Lanes(accelerations_[i]);
    }
  } else {
    for (Size i = 0; i < n; ++i) a[i] = 0.0;
  }
  if (loads_change_ || ground_changes_ || !driven_.empty()) {
    const Lanes* const applied = applied_.block(four);
    if (coupled_) {
      for (Size i = 0; i < n; ++i)
        for (Size j = 0; j < n; ++j) a[i] += Lanes(motion.inverse_matrix_[n * i + j]) * applied[j];
    } else {
      for (Size i = 0; i < n; ++i) a[i] += Lanes(motion.inverse_mass_[i]) * applied[i];
    }
  }
  const Lanes* const own_rate = own_rate_.block(four);
  for (Size i = 0; i < memories_; ++i) r[i] = own_rate[i];
  const Lanes* const rows = terms_.block(four);
  for (Size b = 0; b < parts_.size(); ++b) {
    const Part& part = parts_[b];
    const Motion::ElementSlopes& slopes = elements_[b];
    Lanes travel = 0.0, free = 0.0;
    for (Size i = 0; i < n; ++i) {
      travel += Lanes(part.g[i]) * x[i];
      free += Lanes(part.g[i]) * w[i];
    }
    Lanes rate = free;
    if (part.driven >= 0 && !driven_.empty()) {
      const Lanes* const input = inputs_.block(four) + 2 * part.driven;
      travel += Lanes(part.driven_sign) * input[0];
      rate += Lanes(part.driven_sign) * input[1];
      if (part.driven_too >= 0) {
        const Lanes* const other = inputs_.block(four) + 2 * part.driven_too;
        travel -= Lanes(part.driven_sign) * other[0];
        rate -= Lanes(part.driven_sign) * other[1];
      }
    }
    Lanes f = Lanes(slopes.stiffness_n_per_m) * travel + Lanes(slopes.damping_ns_per_m) * rate;
    for (const Term& term : part.terms) f += Lanes(term.factor) * rows[term.row];
    if (memories_ > 0) {
      const Motion::Branch& branch = motion.branches_[b];
      const MemorySlopes* law = laws_.data() + part.first_law_slopes;
      Size state = branch.first_state;
      for (Size k = branch.first_memory; k < branch.last_law; ++k, ++law) {
        const LawMemory& memory = motion.laws_[k].kind->memory;
        const Lanes seen = memory.jump && motion.held() ? free : rate;
        f += Lanes(slopes.pulling * slopes.followed * law->df_dx) * travel + Lanes(slopes.pulling * law->df_dv) * seen;
        const auto states = static_cast<Size>(memory.states);
        for (Size i = 0; i < states; ++i) {
          f += Lanes(slopes.pulling * law->df_dz[i]) * y[state + i];
          Lanes& own = r[state + i];
          own += Lanes(slopes.followed * law->dz_dx[i]) * travel + Lanes(law->dz_dv[i]) * seen;
          for (Size j = 0; j < states; ++j) own += Lanes(law->dz_dz[max_law_states * i + j]) * y[state + j];
        }
        state += states;
      }
    }
    if (part.sensed >= 0) forces_.block(four)[part.sensed] = f;
    for (Size i = 0; i < n; ++i) a[i] -= Lanes(part.pull[i]) * f;
  }
}

/// The stage c after the start of the step for all directions; the first one for `first`.
template <int N>
void Tangent::all_stages(const Motion& motion, bool first, double c, double weight) {
  const Size n = N > 0 ? N : masses_, s = memories_;
  const Lanes step = c, share = weight;
  for (Size four = 0; four < fours(); ++four) {
    Lanes* const state = state_.block(four);
    Lanes* const slope = stage_.block(four);
    Lanes* const sum = sum_.block(four);
    Lanes few[3 * (N > 0 ? N : 1)];
    Lanes* const x = N > 0 ? few : scratch_.data();
    Lanes *const w = x + n, *const a = w + n;
    Lanes *const y = scratch_.data() + 3 * n, *const r = y + s;
    for (Size i = 0; i < n; ++i) {
      x[i] = first ? state[i] : state[i] + step * slope[i];
      w[i] = first ? state[n + i] : state[n + i] + step * slope[n + i];
    }
    for (Size i = 0; i < s; ++i) y[i] = first ? state[2 * n + i] : state[2 * n + i] + step * slope[2 * n + i];
    evaluate<N>(motion, four, x, w, y, a, r);
    const auto keep = [&](Size row, Lanes value) {
      slope[row] = value;
      sum[row] = first ? value : sum[row] + share * value;
    };
    for (Size i = 0; i < n; ++i) {
      keep(i, w[i]);
      keep(n + i, a[i]);
    }
    for (Size i = 0; i < s; ++i) keep(2 * n + i, r[i]);
  }
}

void Tangent::all_stages(const Motion& motion, bool first, double c, double weight) {
  switch (masses_) {
    case 1: return all_stages<1>(motion, first, c, weight);
    case 2: return all_stages<2>(motion, first, c, weight);
    case 3: return all_stages<3>(motion, first, c, weight);
    default: return all_stages<0>(motion, first, c, weight);
  }
}

int Tangent::begin(Motion& motion, const double* z, const double* a) {
  if (const int element = prepare_stage(motion, z, a); element >= 0) return element;
  all_stages(motion, true, 0, 1);
  return Motion::all_defined;
}

int Tangent::stage(double c, double weight, Motion& motion, const double* z, const double* a) {
  if (const int element = prepare_stage(motion, z, a); element >= 0) return element;
  all_stages(motion, false, c, weight);
  return Motion::all_defined;
}

void Tangent::finish(double h) {
  const Lanes sixth = h / 6;
  for (Size four = 0; four < fours(); ++four) {
    Lanes* const state = state_.block(four);
    const Lanes* const sum = sum_.block(four);
    for (Size i = 0; i < 2 * masses_ + memories_; ++i) state[i] += sixth * sum[i];
  }
}

void Tangent::read(const Motion& motion, Index column) {
  const Size n = masses_;
  for (Size four = 0; four < fours(); ++four) {
    const Lanes* const state = state_.block(four);
    const Lanes* const slope = stage_.block(four);
    const auto change = [&](SensorKind kind, Index node) {
      Lanes sum = 0.0;
      for (Size i = 0; i < motion.inputs_.size(); ++i)
        if (motion.inputs_[i].node == node && node >= 0 && kind != SensorKind::acceleration)
          sum += inputs_.block(four)[2 * i + (kind == SensorKind::velocity ? 1 : 0)];
      for (const Motion::Weight& weight : motion.weights_[static_cast<Size>(node)]) {
        const auto i = static_cast<Size>(weight.mass);
        sum += Lanes(weight.value) * (kind == SensorKind::displacement ? state[i]
                                      : kind == SensorKind::velocity   ? state[n + i]
                                                                       : slope[n + i]);
      }
      return sum;
    };
    const auto change_of_force = [&](Index element) {
      const auto b = static_cast<Size>(element);
      const Part& part = parts_[b];
      Lanes sum = forces_.block(four)[part.sensed];
      const Lanes b_change = inertances_.block(four)[part.sensed], inertance = motion.branches_[b].inertance_kg;
      for (Size i = 0; i < n; ++i)
        sum += Lanes(part.g[i]) * (b_change * Lanes(accelerations_[i]) + inertance * slope[n + i]);
      for (Size i = 0; i < motion.inputs_.size(); ++i)
        if (motion.inputs_[i].inside == element) sum -= inputs_.block(four)[2 * i];
      return sum;
    };
    for (Size i = 0; i < motion.sensors_.size(); ++i) {
      const Motion::SensorPlace& sensor = motion.sensors_[i];
      Lanes reading = sensor.kind == SensorKind::force
                          ? change_of_force(sensor.element)
                          : change(sensor.kind, sensor.to) - change(sensor.kind, sensor.from);
      for (Size input = 0; input < motion.inputs_.size(); ++input)
        if (motion.inputs_[input].accelerates_ground) reading += Lanes(sensor.ground) * inputs_.block(four)[2 * input];
      for (Size lane = 0; lane < Lanes::count && 4 * four + lane < active_; ++lane)
        outputs[4 * four + lane](static_cast<Index>(i), column) = reading[static_cast<int>(lane)];
    }
  }
  const auto faded = [&](const Variation& v) { return v.kept_samples >= 0 && v.kept_samples <= column + 1; };
  while (active_ > 0 && faded(variations_[active_ - 1])) --active_;
}

}  // namespace wheelhop
