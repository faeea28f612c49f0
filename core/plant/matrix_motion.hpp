/// \file
/// Newton's equations of a plant in matrix form, M^-1 applied to all that acts on the masses, for the inner loop of a
/// simulation. What has constant slopes is one pair of matrices; each element beyond that acts along its own direction
/// g (what its travel is made of):
///   a = b(u) - K q - D v - sum over elements of (M^-1 g) f(g'q + x_u, g'v + v_u, z).
/// The drive is held, so b, x_u and v_u are computed once an interval. `Motion` has the same equations element by
/// element, with everything that is asked of them less often.
#pragma once

#include <algorithm>
#include <array>
#include <type_traits>
#include <vector>

#include "core/plant/lanes.hpp"
#include "core/plant/motion.hpp"

namespace wheelhop {

/// One number a mass: in registers for N masses known to the compiler, on the heap for N = 0.
template <class V, int N>
struct PerMass {
  explicit PerMass(std::size_t) {}
  V& operator[](std::size_t i) { return values[i]; }
  const V& operator[](std::size_t i) const { return values[i]; }
  std::array<V, N> values{};
};
template <class V>
struct PerMass<V, 0> {
  explicit PerMass(std::size_t masses) : values(masses, V(0.0)) {}
  V& operator[](std::size_t i) { return values[i]; }
  const V& operator[](std::size_t i) const { return values[i]; }
  std::vector<V> values;
};

/// The equations of one plant (V = double) or of four plants of the same graph and laws (V = Lanes), N masses or, for
/// N = 0, any number. Evaluations allocate nothing. Cost of one: 2 n^2 + (number of curved elements) (3 n + laws)
/// multiply-adds; it agrees with `Motion::accelerations` to round-off.
template <class V, int N>
class MatrixMotion {
 public:
  /// @param motions one a lane, kept by reference; `hold` sets their schedules
  explicit MatrixMotion(const std::vector<Motion*>& motions);

  std::size_t masses() const {
    if constexpr (N > 0)
      return N;
    else
      return masses_;
  }
  std::size_t memories() const { return memories_; }

  /// Inputs and their rates (m values each) for the evaluations that follow.
  void hold(const V* u, const V* u_rate);

  /// Accelerations a and rates z' at positions q, velocities v and memories z.
  /// @return where all laws were inside their domains and the result is finite; a is undefined elsewhere
  [[gnu::always_inline]] inline Truth<V> accelerations(const PerMass<V, N>& q, const PerMass<V, N>& v, const V* z,
                                                       PerMass<V, N>& a, V* z_rate) const {
    const std::size_t n = masses();
    for (std::size_t i = 0; i < n; ++i) {
      V sum = b_[i];
      for (std::size_t j = 0; j < n; ++j) sum -= stiffness_[n * i + j] * q[j];  // positions are known a stage earlier
      for (std::size_t j = 0; j < n; ++j) sum -= damping_[n * i + j] * v[j];
      a[i] = sum;
    }
    Truth<V> inside = finite(V(0.0));
    for (const Curved& element : curved_) {
      V travel = element.travel, free_rate = 0.0;
      for (std::size_t i = 0; i < n; ++i) {
        travel += element.g[i] * q[i];
        free_rate += element.g[i] * v[i];
      }
      V f;
      if (element.simple)
        inside = both(inside, law(element.first_law, travel, element.rate + free_rate, f));
      else
        inside = both(inside, force(element, travel, element.rate + free_rate, free_rate, z, f, z_rate));
      if constexpr (std::is_same_v<V, double>)
        if (!inside) [[unlikely]]
          return false;
      for (std::size_t i = 0; i < n; ++i) a[i] -= element.pull[i] * f;
    }
    if (n == 0) return inside;  // all nodes are held
    V sum = a[0];
    for (std::size_t i = 1; i < n; ++i) sum += a[i];
    return both(inside, finite(sum));
  }

 private:
  struct Curved {
    PerMass<V, N> g, pull;  // pull: M^-1 g
    std::size_t first_law, first_memory, last_law, first_state;
    bool modified, simple;       // simple: one law without memory or modification
    V travel = 0.0, rate = 0.0;  // what the drives add to them
    V stiffness, damping, play, contact, offset, rest;
  };
  Truth<V> force(const Curved& element, V travel, V rate, V free_rate, const V* z, V& f, V* z_rate) const;
  Truth<V> law(std::size_t k, V x, V v, V& f) const;
  Truth<V> law_by_lane(std::size_t k, V x, V v, V& f) const;
  Truth<V> memory_law(std::size_t k, V x, V v, const V* z, V& f, V* z_rate) const;

  void follow_schedules(const V* u);

  std::vector<Motion*> motions_;
  std::size_t masses_, memories_;
  PerMass<V, N * N> stiffness_, damping_;  // M^-1 K and M^-1 D, a row a mass
  std::vector<Curved> curved_;
  std::vector<std::vector<V>> values_;  // of the laws, for lanes
  std::vector<double> told_;            // inputs of one lane, where laws follow any
  PerMass<V, N> load_, b_;              // load_: what of b is constant
  struct Drive {
    bool moves_node;
    std::vector<V> on_mass, on_mass_rate;  // change of b with u and with u'
    std::vector<double> travel;            // of the curved elements: change of their travel with u
  };
  std::vector<Drive> drives_;
};

namespace lanes {

inline void put(double& to, int, double value) { to = value; }
inline void put(Lanes& to, int lane, double value) { to.set(lane, value); }
inline double at(double from, int) { return from; }
inline double at(Lanes from, int lane) { return from[lane]; }

/// Of each lane its own number.
template <class V, class Function>
V gather(const std::vector<Motion*>& motions, Function&& number) {
  return each_lane<V>([&](std::size_t lane) { return number(*motions[lane]); });
}

}  // namespace lanes

template <class V, int N>
MatrixMotion<V, N>::MatrixMotion(const std::vector<Motion*>& motions)
    : motions_(motions),
      masses_(static_cast<std::size_t>(motions[0]->masses())),
      memories_(static_cast<std::size_t>(motions[0]->memories())),
      stiffness_(masses_ * masses_),
      damping_(masses_ * masses_),
      load_(masses_),
      b_(masses_) {
  const Motion& first = *motions[0];
  const std::size_t n = masses_;
  for (const Motion::Drive& drive : first.inputs_)
    drives_.push_back({drive.node >= 0, std::vector<V>(n, V(0.0)), std::vector<V>(n, V(0.0)), {}});
  const auto accelerated = [&](const std::vector<double>& forces, std::size_t i) {
    return lanes::gather<V>(motions, [&](const Motion& motion) { return motion.accelerated(forces.data(), i); });
  };
  // What the displacement of a node is made of, added to a direction.
  const auto add_node = [&](std::size_t node, double sign, std::vector<double>& direction) {
    for (const Motion::Weight& weight : first.weights(static_cast<Index>(node)))
      direction[static_cast<std::size_t>(weight.mass)] += sign * weight.value;
  };
  for (std::size_t b = 0; b < first.branches_.size(); ++b) {
    const Motion::Branch& branch = first.branches_[b];
    std::vector<double> g(n, 0.0);
    add_node(branch.to, 1, g);
    add_node(branch.from, -1, g);
    const auto of = [&](double Motion::Branch::*member) {
      return lanes::gather<V>(motions, [&](const Motion& motion) { return motion.branches_[b].*member; });
    };
    V stiffness = of(&Motion::Branch::stiffness_n_per_m), damping = of(&Motion::Branch::damping_ns_per_m);
    if (!branch.modified) {
      for (std::size_t i = 0; i < n; ++i) {
        const V pull = accelerated(g, i);
        for (std::size_t j = 0; j < n; ++j) {
          stiffness_[n * i + j] += pull * stiffness * V(g[j]);
          damping_[n * i + j] += pull * damping * V(g[j]);
        }
        if (branch.driven < 0) continue;
        Drive& drive = drives_[static_cast<std::size_t>(branch.driven)];
        drive.on_mass[i] -= pull * stiffness * V(branch.driven_sign);
        drive.on_mass_rate[i] -= pull * damping * V(branch.driven_sign);
      }
      if (branch.first_curved == branch.last_law) continue;
      stiffness = damping = 0.0;
    }
    for (std::size_t d = 0; d < drives_.size(); ++d)
      drives_[d].travel.push_back(static_cast<int>(d) == branch.driven       ? branch.driven_sign
                                  : static_cast<int>(d) == branch.driven_too ? -branch.driven_sign
                                                                             : 0.0);
    PerMass<V, N> direction(n), pull(n);
    for (std::size_t i = 0; i < n; ++i) {
      direction[i] = g[i];
      pull[i] = accelerated(g, i);
    }
    curved_.push_back(
        {direction, pull, branch.first_curved, branch.first_memory, branch.last_law, branch.first_state,
         branch.modified,
         !branch.modified && branch.last_law == branch.first_memory && branch.first_memory == branch.first_curved + 1,
         0.0, 0.0, stiffness, damping, of(&Motion::Branch::play_m), of(&Motion::Branch::contact_n),
         of(&Motion::Branch::offset_m), of(&Motion::Branch::rest_force_n)});
  }
  for (std::size_t d = 0; d < drives_.size(); ++d) {
    if (drives_[d].moves_node) continue;
    for (std::size_t i = 0; i < n; ++i)
      drives_[d].on_mass[i] = lanes::gather<V>(motions, [&](const Motion& motion) {
        return motion.accelerated(motion.input_forces(static_cast<Index>(d)).data(), i);
      });
  }
  for (std::size_t i = 0; i < n; ++i)
    load_[i] = lanes::gather<V>(
        motions, [&](const Motion& motion) { return motion.accelerated(motion.load_forces().data(), i); });
  if (first.has_schedules()) told_.resize(first.inputs_.size());
  if constexpr (!std::is_same_v<V, double>)
    for (std::size_t k = 0; k < first.laws_.size(); ++k) {
      values_.emplace_back();
      for (std::size_t i = 0; i < first.laws_[k].values.size(); ++i)
        values_.back().push_back(
            lanes::gather<V>(motions, [&](const Motion& motion) { return motion.laws_[k].values[i]; }));
    }
}

template <class V, int N>
void MatrixMotion<V, N>::hold(const V* u, const V* u_rate) {
  const std::size_t n = masses();
  if (!told_.empty()) follow_schedules(u);
  for (std::size_t i = 0; i < n; ++i) b_[i] = load_[i];
  for (Curved& element : curved_) element.travel = element.rate = 0.0;
  for (std::size_t d = 0; d < drives_.size(); ++d) {
    const Drive& drive = drives_[d];
    for (std::size_t i = 0; i < n; ++i) b_[i] += drive.on_mass[i] * u[d] + drive.on_mass_rate[i] * u_rate[d];
    if (!drive.moves_node) continue;
    for (std::size_t e = 0; e < curved_.size(); ++e) {
      curved_[e].travel += V(drive.travel[e]) * u[d];
      curved_[e].rate += V(drive.travel[e]) * u_rate[d];
    }
  }
}

template <class V, int N>
[[gnu::noinline]] void MatrixMotion<V, N>::follow_schedules(const V* u) {
  for (std::size_t lane = 0; lane < motions_.size(); ++lane) {
    Motion& own = *motions_[lane];
    for (std::size_t i = 0; i < told_.size(); ++i) told_[i] = lanes::at(u[i], static_cast<int>(lane));
    own.set_schedules(told_.data());
    if constexpr (!std::is_same_v<V, double>)
      for (const Motion::Scheduled& number : own.scheduled_)
        values_[number.law][number.value].set(static_cast<int>(lane), own.laws_[number.law].values[number.value]);
  }
}

template <class V, int N>
[[gnu::always_inline]] inline Truth<V> MatrixMotion<V, N>::law(std::size_t k, V x, V v, V& f) const {
  if constexpr (std::is_same_v<V, double>) {
    return motions_[0]->laws_[k].force(x, v, f);
  } else {
    const auto of_lanes = motions_[0]->laws_[k].kind->force_of_lanes;
    return of_lanes ? of_lanes(values_[k].data(), x, v, f) : law_by_lane(k, x, v, f);
  }
}

template <class V, int N>
[[gnu::noinline]] Truth<V> MatrixMotion<V, N>::law_by_lane(std::size_t k, V x, V v, V& f) const {
  LaneMask inside{};
  for (int lane = 0; lane < V::count; ++lane) {
    double own = 0;
    inside.bits[lane] = motions_[static_cast<std::size_t>(lane)]->laws_[k].force(x[lane], v[lane], own) ? -1 : 0;
    f.set(lane, own);
  }
  return inside;
}

template <class V, int N>
inline Truth<V> MatrixMotion<V, N>::memory_law(std::size_t k, V x, V v, const V* z, V& f, V* z_rate) const {
  if constexpr (std::is_same_v<V, double>) {
    const Law& own = motions_[0]->laws_[k];
    return own.kind->memory.force(own.values, x, v, z, f, z_rate);
  } else {
    LaneMask inside{};
    const auto states = static_cast<std::size_t>(motions_[0]->laws_[k].states());
    for (int lane = 0; lane < V::count; ++lane) {
      const Law& own = motions_[static_cast<std::size_t>(lane)]->laws_[k];
      double state[max_law_states], rate[max_law_states], one = 0;
      for (std::size_t i = 0; i < states; ++i) state[i] = lanes::at(z[i], lane);
      inside.bits[lane] = own.kind->memory.force(own.values, x[lane], v[lane], state, one, rate) ? -1 : 0;
      f.set(lane, one);
      for (std::size_t i = 0; i < states; ++i) lanes::put(z_rate[i], lane, rate[i]);
    }
    return inside;
  }
}

template <class V, int N>
[[gnu::noinline]] Truth<V> MatrixMotion<V, N>::force(const Curved& element, V travel, V rate, V free_rate, const V* z,
                                                     V& f, V* z_rate) const {
  if (element.modified) {
    const V inside_play =
        choose(travel < -element.play, -element.play, choose(travel > element.play, element.play, travel));
    travel = travel - inside_play + element.offset;
  }
  f = element.stiffness * travel + element.damping * rate;
  Truth<V> inside = finite(V(0.0));
  V one;
  for (std::size_t k = element.first_law; k < element.first_memory; ++k) {
    inside = both(inside, law(k, travel, rate, one));
    f += one;
  }
  std::size_t state = element.first_state;
  for (std::size_t k = element.first_memory; k < element.last_law; ++k) {
    const LawMemory& memory = motions_[0]->laws_[k].kind->memory;
    inside = both(inside, memory_law(k, travel, memory.jump && motions_[0]->held() ? free_rate : rate, z + state, one,
                                     z_rate + state));
    f += one;
    state += static_cast<std::size_t>(memory.states);
  }
  if (element.modified) {
    // A number that is not finite may not hide behind the bound of a contact.
    inside = both(inside, finite(f));
    f = f - element.rest;
    f = choose(f > element.contact, element.contact, f);
  }
  return inside;
}

}  // namespace wheelhop
