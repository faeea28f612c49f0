#include "core/plant/simulate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/plant/drive_course.hpp"
#include "core/plant/linearise.hpp"
#include "core/plant/matrix_motion.hpp"
#include "core/plant/schedule.hpp"
#include "core/plant/tangent.hpp"

namespace wheelhop {
namespace {

constexpr double kMemorySpeed = 1;  // m/s, at which laws with memory are judged: fast travel of a damper

void check_shapes(const Plant& plant, Index memories, ConstMatrixRef drive, const SimulateOptions& options) {
  if (drive.rows() != plant.input_count())
    throw UserError(fmt::format("plant \"{}\": expected a drive with {} rows (one an input), found {}", plant.name,
                                plant.input_count(), drive.rows()));
  if (options.substeps < 1 || options.decimation < 1 || options.lead_samples < 0)
    throw UserError("simulate: expected substeps >= 1, decimation >= 1 and lead_samples >= 0");
  if (options.lead_samples >= drive.cols())
    throw UserError(fmt::format("simulate: expected a drive longer than its {} lead samples, found {} samples",
                                options.lead_samples, drive.cols()));
  if (options.sampled_drive.size() != 0 &&
      (options.sampled_drive.rows() != drive.rows() || options.sampled_drive.cols() != drive.cols()))
    throw UserError("simulate: expected a sampled drive of the drive's shape");
  const Index size = options.initial_state.size();
  if (size != 0 && size != 2 * plant.mass_count() && size != 2 * plant.mass_count() + memories)
    throw UserError(
        fmt::format("simulate: expected an initial state of {} numbers (positions, velocities) or {} more "
                    "(internal states), found {}",
                    2 * plant.mass_count(), memories, size));
}

/// Fastest pole [1/s] of the plant linearised at zero; 0 where it cannot be.
double fastest_pole(const Plant& plant) {
  double fastest = 0;
  for (const Plant& there : at_ends_of_schedules(plant))
    if (const LinearPlant model = linearise(there); model.A.size() > 0)
      fastest = std::max(fastest, eigenvalues(model.A).cwiseAbs().maxCoeff());
  return fastest;
}

/// Steps in one hold interval with which |s| h <= 2.
Index steps_for(double fastest, double hold_s, Index least, Index most) {
  const double steps = std::ceil(0.5 * fastest * hold_s);
  return static_cast<Index>(std::clamp(steps, static_cast<double>(least), static_cast<double>(most)));
}

/// One simulation on its way.
struct Lane {
  Lane(const Plant& of, ConstMatrixRef its_drive, const SimulateOptions& its_options)
      : plant(of), drive(its_drive), options(its_options), motion(of) {}

  void fail(Status status, std::string message, Index column, double time_s) {
    result.status = status;
    result.message = std::move(message);
    result.failure_time_s = time_s;
    result.states.conservativeResize(size(), column);
    result.outputs.conservativeResize(plant.sensor_count(), column);
    going = false;
  }
  Index size() const { return 2 * motion.masses() + motion.memories(); }
  double start_s() const { return -static_cast<double>(options.lead_samples) / plant.hold_hz(); }

  const Plant& plant;
  const ConstMatrixRef drive;
  const SimulateOptions& options;
  Motion motion;
  Simulation result;
  Vector state;  // at the start
  bool going = true;
};

/// Internal states of laws are judged interval by interval, see SimulateOptions::most_substeps.
bool chooses_steps(const Lane& lane) {
  return lane.motion.memories() > 0 && lane.options.most_substeps > lane.options.substeps;
}

void start(Lane& lane) {
  const Plant& plant = lane.plant;
  const SimulateOptions& options = lane.options;
  check_shapes(plant, lane.motion.memories(), lane.drive, options);
  if (!all_finite(lane.drive) || !all_finite(options.sampled_drive) || !all_finite(options.initial_state))
    return lane.fail(Status::not_finite, "the drive or the initial state is not finite", 0, lane.start_s());
  if (const std::string beyond = schedule_fault(plant); !beyond.empty())
    return lane.fail(Status::outside_domain, beyond, 0, lane.start_s());
  lane.state = Vector::Zero(lane.size());
  if (options.initial_state.size() != 0) {
    lane.state.head(options.initial_state.size()) = options.initial_state;
  } else if (options.from_equilibrium) {
    const Equilibrium equilibrium = static_equilibrium(plant, lane.drive.col(0));
    if (equilibrium.status == Status::ok)
      lane.state.head(plant.mass_count()) = equilibrium.positions;
    else if (equilibrium.status != Status::rank_deficient || !options.or_at_zero)
      return lane.fail(equilibrium.status, equilibrium.message, 0, lane.start_s());
  }
  const Index kept = (lane.drive.cols() - options.lead_samples - 1) / options.decimation + 1;
  lane.result.states.resize(lane.size(), kept);
  lane.result.outputs.resize(plant.sensor_count(), kept);
}

/// Classical Runge-Kutta of fourth order on q' = v, v' = a(q, v, z), z' = g(q, v, z), for one plant or four.
template <class V, int N>
class March {
 public:
  March(const std::vector<Lane*>& lanes, Tangent* tangent)
      : lanes_(lanes),
        first_(*lanes[0]),
        tangent_(tangent),
        equations_(motions(lanes)),
        n_(equations_.masses()),
        s_(equations_.memories()),
        inputs_(static_cast<std::size_t>(first_.motion.inputs())),
        substeps_(first_.options.substeps) {
    for (std::vector<V>* z : {&z_, &z_stage_, &r1_, &r2_, &r3_, &r4_}) z->assign(s_, V(0.0));
    for (std::vector<V>* u : {&u_, &u_step_, &u_rate_, &u_felt_}) u->assign(inputs_, V(0.0));
    if (!first_.motion.held()) pieces_.resize(inputs_);
    for (const Lane* lane : lanes)
      drives_.push_back({lane->drive.data(), lane->drive.outerStride(), lane->drive.cols() - 1});
    told_.resize(2 * inputs_);
    state_.resize(2 * n_ + s_);
    acceleration_.resize(n_);
    rates_.resize(s_);
    for (std::size_t lane = 0; lane < lanes.size(); ++lane) {
      const auto l = static_cast<int>(lane);
      for (std::size_t i = 0; i < n_; ++i) {
        lanes::put(q_[i], l, lanes[lane]->state[static_cast<Index>(i)]);
        lanes::put(v_[i], l, lanes[lane]->state[static_cast<Index>(n_ + i)]);
      }
      for (std::size_t i = 0; i < s_; ++i) lanes::put(z_[i], l, lanes[lane]->state[static_cast<Index>(2 * n_ + i)]);
    }
  }

  void run() {
    const double hold_s = 1 / first_.plant.hold_hz();
    const SimulateOptions& options = first_.options;
    const bool adapts = chooses_steps(first_);
    Index longest = 0, next_kept = options.lead_samples;
    for (const Lane* lane : lanes_) longest = std::max(longest, lane->going ? lane->drive.cols() : 0);
    for (k_ = 0; k_ < longest; ++k_) {
      follow_drives(hold_s);
      const bool kept = k_ == next_kept;
      if (kept) next_kept += options.decimation;
      const bool apart = options.sampled_drive.size() != 0;
      bool begun = false;
      if (kept) {
        hold(true, hold_s);
        if (!begin()) return;
        keep();
        begun = !apart;  // under another drive the first stage is another one
      }
      // Nobody asks for the state after the last sample.
      bool last = true;
      for (Lane* lane : lanes_) {
        lane->going = lane->going && k_ + 1 < lane->drive.cols();
        last = last && !lane->going;
      }
      if (last) return;
      if (!kept || apart) hold(false, hold_s);
      for (Index step = 0; step < substeps_; ++step) {
        passed_ = static_cast<double>(step);
        if (step > 0 && smooth()) move_drives(passed_ / static_cast<double>(substeps_), hold_s);
        if (!begun && !begin()) return;
        if (adapts && step == 0) {
          tell_inputs(0);
          const double* const x = state(0, q_, v_, z_);
          first_.motion.place(x, x + n_);
          substeps_ = steps_for(first_.motion.fastest_yielding(), hold_s, options.substeps, options.most_substeps);
        }
        if (!finish(hold_s / static_cast<double>(substeps_), hold_s)) return;
        begun = false;
      }
    }
  }

 private:
  static std::vector<Motion*> motions(const std::vector<Lane*>& lanes) {
    std::vector<Motion*> list;
    for (Lane* lane : lanes) list.push_back(&lane->motion);
    return list;
  }
  /// Values of input i in interval k_; a lane whose drive has ended keeps its last.
  V drive(std::size_t i) const {
    return each_lane<V>([&](std::size_t lane) {
      const DriveView& own = drives_[lane];
      return own.values[own.stride * std::min(k_, own.last) + static_cast<Index>(i)];
    });
  }
  V sampled_drive(std::size_t i) const {
    return each_lane<V>([&](std::size_t lane) {
      return lanes_[lane]->options.sampled_drive(static_cast<Index>(i), std::min(k_, drives_[lane].last));
    });
  }

  /// The drives of interval k_, and their steps at its start, which memories that know what a step does follow at once.
  void follow_drives(double hold_s) {
    if (smooth()) return take_pieces();
    for (std::size_t i = 0; i < inputs_; ++i) {
      const V now = drive(i);
      u_step_[i] = k_ > 0 ? now - u_[i] : V(0.0);
      u_rate_[i] = u_step_[i] / V(hold_s);
      u_[i] = now;
    }
    if (s_ == 0) return;
    for (std::size_t lane = 0; lane < lanes_.size(); ++lane) {
      const auto l = static_cast<int>(lane);
      for (std::size_t i = 0; i < s_; ++i) state_[i] = lanes::at(z_[i], l);
      for (std::size_t i = 0; i < inputs_; ++i) told_[i] = lanes::at(u_step_[i], l);
      if (tangent_) tangent_->step_memories(first_.motion, k_, told_.data(), state_.data());
      lanes_[lane]->motion.step_memories(told_.data(), state_.data());
      for (std::size_t i = 0; i < s_; ++i) lanes::put(z_[i], l, state_[i]);
    }
  }

  bool smooth() const { return !pieces_.empty(); }
  /// The course of drives that are not held over interval k_.
  void take_pieces() {
    for (std::size_t i = 0; i < inputs_; ++i)
      for (std::size_t lane = 0; lane < lanes_.size(); ++lane) {
        const DriveView& own = drives_[lane];
        const auto at = [&](Index j) { return own.values[own.stride * j + static_cast<Index>(i)]; };
        const DrivePiece<double> piece = smooth_piece(at, std::min(k_, own.last), own.last);
        for (std::size_t p = 0; p < 4; ++p) lanes::put(pieces_[i].c[p], static_cast<int>(lane), piece.c[p]);
      }
  }
  /// Drives that are not held, at a fraction of interval k_.
  [[gnu::noinline]] void move_drives(double fraction, double hold_s) {
    for (std::size_t i = 0; i < inputs_; ++i) {
      u_felt_[i] = pieces_[i].value(V(fraction));
      u_rate_[i] = pieces_[i].slope(V(fraction)) / V(hold_s);
    }
    equations_.hold(u_felt_.data(), u_rate_.data());
    if (!tangent_) return;
    tell_inputs(0);
    tangent_->set_inputs(first_.motion, k_, false, hold_s, fraction);
  }

  /// @param sampled the drive that accelerations at the sample itself read, else that of the interval behind it
  void hold(bool sampled, double hold_s) {
    if (smooth()) return move_drives(0, hold_s);
    sampled = sampled && first_.options.sampled_drive.size() != 0;
    u_felt_ = u_;
    if (sampled)
      for (std::size_t i = 0; i < inputs_; ++i) u_felt_[i] = sampled_drive(i);
    equations_.hold(u_felt_.data(), u_rate_.data());
    if (!tangent_) return;
    tell_inputs(0);
    tangent_->set_inputs(first_.motion, k_, sampled, hold_s);
  }

  /// The motion of a lane gets the inputs that are held now.
  void tell_inputs(std::size_t lane) {
    for (std::size_t i = 0; i < inputs_; ++i) {
      told_[i] = lanes::at(u_felt_[i], static_cast<int>(lane));
      told_[inputs_ + i] = lanes::at(u_rate_[i], static_cast<int>(lane));
    }
    lanes_[lane]->motion.set_inputs(told_.data(), told_.data() + inputs_);
  }

  /// State of a lane as [q; v; z].
  const double* state(std::size_t lane, const PerMass<V, N>& q, const PerMass<V, N>& v, const std::vector<V>& z) {
    for (std::size_t i = 0; i < n_; ++i) {
      state_[i] = lanes::at(q[i], static_cast<int>(lane));
      state_[n_ + i] = lanes::at(v[i], static_cast<int>(lane));
    }
    for (std::size_t i = 0; i < s_; ++i) state_[2 * n_ + i] = lanes::at(z[i], static_cast<int>(lane));
    return state_.data();
  }
  const double* accelerations(std::size_t lane, const PerMass<V, N>& a) {
    for (std::size_t i = 0; i < n_; ++i) acceleration_[i] = lanes::at(a[i], static_cast<int>(lane));
    return acceleration_.data();
  }

  /// Readings and states at the sample that was begun.
  void keep() {
    for (std::size_t lane = 0; lane < lanes_.size(); ++lane) {
      Lane& own = *lanes_[lane];
      if (!own.going) continue;
      tell_inputs(lane);
      const double* const x = state(lane, q_, v_, z_);
      own.motion.outputs(x, x + n_, x + 2 * n_, accelerations(lane, a1_), own.result.outputs.col(column_).data());
      std::copy_n(x, own.size(), own.result.states.col(column_).data());
    }
    if (tangent_) tangent_->read(first_.motion, column_);
    ++column_;
  }

  /// Lanes that have left the domain of their laws end here. False if none goes on.
  [[gnu::noinline]] bool still_inside(Truth<V> inside, PerMass<V, N> q, PerMass<V, N> v, const std::vector<V>& z) {
    bool any = false;
    for (std::size_t lane = 0; lane < lanes_.size(); ++lane) {
      Lane& own = *lanes_[lane];
      if (!own.going) continue;
      if constexpr (std::is_same_v<V, Lanes>) {
        if (inside[static_cast<int>(lane)]) {
          any = true;
          continue;
        }
      }
      tell_inputs(lane);
      const double* const x = state(lane, q, v, z);
      left_domain(own, own.motion.accelerations(x, x + n_, x + 2 * n_, acceleration_.data(), rates_.data()));
    }
    return any;
  }
  void left_domain(Lane& lane, int element) const {
    element = std::max(element, 0);  // a sum of finite forces that is not finite: any of them
    const double hold_s = 1 / lane.plant.hold_hz(), time_s = lane.start_s() + static_cast<double>(k_) * hold_s;
    lane.fail(Status::outside_domain,
              fmt::format("element \"{}\" left the domain of its laws at t = {:.6g} s (travel {:.6g} m): the drive "
                          "is too strong for this plant, or the step of {:.6g} s too long",
                          lane.plant.elements[static_cast<std::size_t>(element)].name, time_s,
                          lane.motion.travel(element), hold_s / static_cast<double>(substeps_)),
              column_, time_s);
  }

  /// One evaluation, and what the tangent makes of it.
  [[gnu::always_inline]] bool evaluate(const PerMass<V, N>& q, const PerMass<V, N>& v, const std::vector<V>& z,
                                       PerMass<V, N>& a, std::vector<V>& r) {
    const Truth<V> inside = equations_.accelerations(q, v, z.data(), a, r.data());
    return all(inside) || still_inside(inside, q, v, z);
  }

  /// First stage of a step: the accelerations there, which an output may read as well.
  [[gnu::always_inline]] bool begin() {
    if (!evaluate(q_, v_, z_, a1_, r1_)) return false;
    return !tangent_ || tangent_begins();
  }
  [[gnu::noinline]] bool tangent_begins() {
    const double* const x = state(0, q_, v_, z_);
    first_.motion.place(x, x + n_);
    return tangent_inside(tangent_->begin(first_.motion, x + 2 * n_, accelerations(0, a1_)));
  }
  [[gnu::always_inline]] bool stage(double c, double weight, const PerMass<V, N>& q, const PerMass<V, N>& v,
                                    PerMass<V, N>& a, std::vector<V>& r) {
    if (!evaluate(q, v, z_stage_, a, r)) return false;
    return !tangent_ || tangent_follows(c, weight, q, v, a);
  }
  [[gnu::noinline]] bool tangent_follows(double c, double weight, PerMass<V, N> q, PerMass<V, N> v, PerMass<V, N> a) {
    const double* const x = state(0, q, v, z_stage_);
    first_.motion.place(x, x + n_);
    return tangent_inside(tangent_->stage(c, weight, first_.motion, x + 2 * n_, accelerations(0, a)));
  }
  bool tangent_inside(int element) {
    if (element >= 0) left_domain(first_, element);
    return element < 0;
  }

  struct Stages {
    explicit Stages(std::size_t n) : q(n), v2(n), v3(n), v4(n), a2(n), a3(n), a4(n) {}
    PerMass<V, N> q, v2, v3, v4, a2, a3, a4;
  };
  /// The step of length h that was begun. Every stage is checked: one beyond the pole of an end stop would read a force
  /// of the wrong sign and go on as if nothing had happened.
  [[gnu::always_inline]] bool finish(double h, double hold_s) {
    if constexpr (N == 0) return finish(h, hold_s, stages_);
    Stages in_registers(n_);
    return finish(h, hold_s, in_registers);
  }
  [[gnu::always_inline]] bool finish(double h, double hold_s, Stages& stages) {
    auto& [q, v2, v3, v4, a2, a3, a4] = stages;
    const std::size_t n = equations_.masses();
    const V half = 0.5 * h, whole = h, sixth = h / 6, two = 2.0;
    for (std::size_t i = 0; i < n; ++i) {
      q[i] = q_[i] + half * v_[i];
      v2[i] = v_[i] + half * a1_[i];
    }
    for (std::size_t i = 0; i < s_; ++i) z_stage_[i] = z_[i] + half * r1_[i];
    if (smooth()) move_drives((passed_ + 0.5) / static_cast<double>(substeps_), hold_s);
    if (!stage(0.5 * h, 2, q, v2, a2, r2_)) return false;
    for (std::size_t i = 0; i < n; ++i) {
      q[i] = q_[i] + half * v2[i];
      v3[i] = v_[i] + half * a2[i];
    }
    for (std::size_t i = 0; i < s_; ++i) z_stage_[i] = z_[i] + half * r2_[i];
    if (!stage(0.5 * h, 2, q, v3, a3, r3_)) return false;
    for (std::size_t i = 0; i < n; ++i) {
      q[i] = q_[i] + whole * v3[i];
      v4[i] = v_[i] + whole * a3[i];
    }
    for (std::size_t i = 0; i < s_; ++i) z_stage_[i] = z_[i] + whole * r3_[i];
    if (smooth()) move_drives((passed_ + 1) / static_cast<double>(substeps_), hold_s);
    if (!stage(h, 1, q, v4, a4, r4_)) return false;
    for (std::size_t i = 0; i < n; ++i) {
      q_[i] += sixth * (v_[i] + two * (v2[i] + v3[i]) + v4[i]);
      v_[i] += sixth * (a1_[i] + two * (a2[i] + a3[i]) + a4[i]);
    }
    for (std::size_t i = 0; i < s_; ++i) z_[i] += sixth * (r1_[i] + two * (r2_[i] + r3_[i]) + r4_[i]);
    if (tangent_) tangent_->finish(h);
    return true;
  }

  const std::vector<Lane*>& lanes_;
  Lane& first_;
  Tangent* const tangent_;  // of the first lane, the only one then
  MatrixMotion<V, N> equations_;
  const std::size_t n_, s_, inputs_;
  Index substeps_, k_ = 0, column_ = 0;
  PerMass<V, N> q_{n_}, v_{n_}, a1_{n_};
  Stages stages_{n_};
  std::vector<V> z_, z_stage_, r1_, r2_, r3_, r4_, u_, u_step_, u_rate_, u_felt_;
  std::vector<DrivePiece<V>> pieces_;  // of drives that are not held, one each an input; else none
  double passed_ = 0;                  // steps of interval k_ before the present one
  struct DriveView {
    const double* values;
    Index stride, last;
  };
  std::vector<DriveView> drives_;
  std::vector<double> told_, state_, acceleration_, rates_;  // of single lanes
};

/// Runs one simulation, or up to four that are `in_step`.
void march(std::vector<Lane*> lanes, Tangent* tangent) {
  std::vector<Lane> idle;  // what fills the register
  idle.reserve(Lanes::count);
  while (lanes.size() > 1 && lanes.size() < Lanes::count) {
    idle.emplace_back(lanes[0]->plant, lanes[0]->drive, lanes[0]->options).going = false;
    idle.back().state = lanes[0]->state;
    lanes.push_back(&idle.back());
  }
  const auto run = [&]<class V>(V) {
    switch (lanes[0]->motion.masses()) {
      case 1: return March<V, 1>(lanes, tangent).run();
      case 2: return March<V, 2>(lanes, tangent).run();
      case 3: return March<V, 3>(lanes, tangent).run();
      default: return March<V, 0>(lanes, tangent).run();
    }
  };
  if (lanes.size() == 1)
    run(double{});
  else
    run(Lanes{});
}

/// True if two simulations can share a vector register: the same masses, graph and laws, whatever their values, and the
/// same steps.
bool in_step(const Lane& a, const Lane& b) {
  const Plant &one = a.plant, &other = b.plant;
  const auto same = [](const auto& list, const auto& others, auto&& equal) {
    return std::equal(list.begin(), list.end(), others.begin(), others.end(), equal);
  };
  const auto follows = [](const auto& x, const auto& y) { return x.first == y.first; };
  const auto law = [&](const Law& x, const Law& y) {
    return x.kind == y.kind && x.values.size() == y.values.size() && x.schedule.by == y.schedule.by &&
           same(x.schedule.slopes, y.schedule.slopes, follows);
  };
  return !chooses_steps(a) && !chooses_steps(b) && one.hold_hz() == other.hold_hz() &&
         a.options.substeps == b.options.substeps && a.options.decimation == b.options.decimation &&
         a.options.lead_samples == b.options.lead_samples &&
         (a.options.sampled_drive.size() == 0) == (b.options.sampled_drive.size() == 0) &&
         same(one.masses, other.masses, [](const Mass& x, const Mass& y) { return x.name == y.name; }) &&
         same(one.points, other.points,
              [](const Point& x, const Point& y) { return x.name == y.name && x.weights == y.weights; }) &&
         same(one.inputs, other.inputs,
              [](const PlantInput& x, const PlantInput& y) {
                return x.name == y.name && x.kind == y.kind && x.from == y.from && x.to == y.to && x.held == y.held;
              }) &&
         same(one.elements, other.elements, [&](const Element& x, const Element& y) {
           return x.from == y.from && x.to == y.to && same(x.laws, y.laws, law);
         });
}

/// What a lane has found, once it has come to its end.
Simulation result_of(Lane& lane) {
  if (lane.result.status == Status::ok && (!all_finite(lane.result.states) || !all_finite(lane.result.outputs)))
    lane.fail(Status::not_finite, "the state grew beyond all numbers", 0, lane.start_s());
  return std::move(lane.result);
}

}  // namespace

Simulation simulate(const Plant& plant, ConstMatrixRef drive, const SimulateOptions& options, Tangent* tangent) {
  Lane lane(plant, drive, options);
  start(lane);
  if (lane.going) march({&lane}, tangent);
  return result_of(lane);
}

std::vector<Simulation> simulate_side_by_side(const std::vector<SimulationTask>& tasks) {
  std::vector<Lane> lanes;
  lanes.reserve(tasks.size());
  for (const SimulationTask& task : tasks) start(lanes.emplace_back(*task.plant, *task.drive, task.options));
  std::vector<Lane*> open;
  for (Lane& lane : lanes)
    if (lane.going) open.push_back(&lane);
  while (!open.empty()) {
    std::vector<Lane*> together = {open.front()}, later;
    for (std::size_t i = 1; i < open.size(); ++i) {
      const bool fits = together.size() < Lanes::count && in_step(*open.front(), *open[i]);
      (fits ? together : later).push_back(open[i]);
    }
    open = std::move(later);
    march(together, nullptr);
  }
  std::vector<Simulation> results;
  for (Lane& lane : lanes) results.push_back(result_of(lane));
  return results;
}

Index stable_substeps(const Plant& plant, Index cap) {
  double fastest = fastest_pole(plant);
  if (fastest > 0)
    for (const Plant& there : at_ends_of_schedules(plant))
      for (const Element& element : there.elements)
        for (const Law& law : element.laws)
          fastest = std::max({fastest, decay(law, kMemorySpeed), decay(law, -kMemorySpeed)});
  return steps_for(fastest, 1 / plant.hold_hz(), 1, cap);
}

SimulateOptions sparing_steps(const Plant& plant, Index cap, Index most) {
  return {.substeps = steps_for(fastest_pole(plant), 1 / plant.hold_hz(), 1, cap), .most_substeps = most};
}

}  // namespace wheelhop
