#include "core/greybox/plant_fit.hpp"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>

#include "core/data/metrics.hpp"
#include "core/data/slow_channels.hpp"
#include "core/greybox/inner_states.hpp"
#include "core/optimise/bounded_step.hpp"
#include "core/optimise/prior.hpp"
#include "core/plant/dataset.hpp"
#include "core/plant/linearise.hpp"
#include "core/plant/simulate.hpp"

namespace wheelhop {
namespace {

/// Step of the differences, in scales: a tolerance or a typical state is about one, and laws bend within it.
constexpr double kStep = 1e-4;
constexpr double kRounding = 1e-9;       // of a scale
constexpr Index kVisited = 100;          // operating points a record
constexpr std::size_t kGroups = 4;       // of the columns of a Jacobian: each group simulates the plant once more
constexpr double kAtOnceBytes = 2.56e8;  // of columns that are computed beside one another, where all are not kept
constexpr Index kLeastAtOnce = 16;       // whatever their size: a further pass simulates the plant once more
constexpr Index kBeginning = 4;          // samples a state, of a record whose initial state is found: a judgement
constexpr Index kStartIterations = 12;   // of its fit, likewise
constexpr double kAsForetold = 1.1;      // of what a linear estimate leaves, from which it is no estimate, likewise
constexpr double kForgotten = 14;        // e-folds after which an initial state counts as forgotten

/// Values a parameter may take: its range and the start itself; of one that is known within a tolerance, on the side of
/// 0 where it is known to lie.
Range allowed(const std::vector<PlantParameter>& known, const FitParameter& fitted, double start) {
  const double infinity = std::numeric_limits<double>::infinity();
  Range range{-infinity, infinity};
  for (const PlantParameter& parameter : known)
    if (parameter.name == fitted.name) range = parameter.range;
  range.low = std::max(range.low, fitted.least);
  if (fitted.prior_std > 0 && start > 0) range.low = std::max(range.low, 0.0);
  if (fitted.prior_std > 0 && start < 0) range.high = std::min(range.high, 0.0);
  return {std::min(range.low, start), std::max(range.high, start)};
}

/// Bounds of theta: a plant tens of tolerances away is another plant, and may not follow the next drive.
Box bounds(const Plant& plant, const std::vector<FitParameter>& parameters) {
  const std::vector<PlantParameter> known = plant_parameters(plant);
  const double infinity = std::numeric_limits<double>::infinity();
  Box box{Vector(static_cast<Index>(parameters.size())), Vector(static_cast<Index>(parameters.size()))};
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const double start = get_parameter(plant, parameters[i].name);
    const Range range = allowed(known, parameters[i], start);
    const double std = parameters[i].prior_std, most = std > 0 ? kFarthest * std : infinity;
    box.lower(static_cast<Index>(i)) = std::max((range.low - start) / parameters[i].scale, -most);
    box.upper(static_cast<Index>(i)) = std::min((range.high - start) / parameters[i].scale, most);
  }
  return box;
}

/// Adds theta * scale to parameters of a plant. False where one would leave its bounds by more than rounding.
bool move_parameters(Plant& plant, const std::vector<FitParameter>& parameters, ConstVectorRef theta) {
  const std::vector<PlantParameter> known = plant_parameters(plant);
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const double start = get_parameter(plant, parameters[i].name);
    const double value = start + theta(static_cast<Index>(i)) * parameters[i].scale;
    const Range range = allowed(known, parameters[i], start);
    const double inside = std::clamp(value, range.low, range.high);
    if (!(std::abs(value - inside) <= kRounding * parameters[i].scale)) return false;
    set_parameter(plant, parameters[i].name, inside);
  }
  return true;
}

/// Time after which nothing is left of an initial state; infinite where the slowest mode does not decay.
double memory_s(const Plant& plant) {
  const LinearPlant linear = linearise(plant);
  const double slowest = linear.A.size() > 0 ? -eigenvalues(linear.A).real().maxCoeff() : 0;
  return slowest > 0 ? kForgotten / slowest : std::numeric_limits<double>::infinity();
}

/// Samples of a record that an initial state can move, those that are not scored included.
Index remembered_samples(const Plant& plant, const FitRecord& record, double memory_s) {
  const double samples = memory_s * plant.hold_hz() / static_cast<double>(record.ratio);
  return std::clamp<Index>(static_cast<Index>(std::min(samples, 1e9)), record.skip + 1, record.y.cols());
}

/// The records as far as their initial states are seen in them: what is fitted to find nothing else.
std::vector<FitRecord> remembered_part(const Plant& plant, std::vector<FitRecord> records) {
  double memory = memory_s(plant);
  for (const Sensor& sensor : plant.sensors)
    if (sensor.path.high_pass_hz > 0)
      memory = std::max(memory, kForgotten / (2 * std::numbers::pi * sensor.path.high_pass_hz));
  for (FitRecord& record : records)
    record.y.conservativeResize(Eigen::NoChange, remembered_samples(plant, record, memory));
  return records;
}

/// The part of a record's drive that its compared readings depend on.
Matrix drive_until_end(const Plant& plant, const FitRecord& record) {
  const Index read = drive_samples_read(plant, record.y.cols() * record.ratio);
  const Index whole = (read + record.ratio - 1) / record.ratio * record.ratio;
  return record.drive.leftCols(std::min(whole, record.drive.cols()));
}

/// r of a record. False if the simulation failed. @param result its readings become those that the record would hold
bool residual_of(Simulation& result, const FitRecord& record, VectorRef r) {
  if (result.status != Status::ok) return false;
  as_logged(record.slow, result.outputs);
  const Index kept = record.y.cols() - record.skip;
  r.reshaped(record.y.rows(), kept) = record.weight_std.cwiseInverse().asDiagonal() *
                                      (result.outputs.leftCols(record.y.cols()) - record.y).rightCols(kept);
  return r.allFinite();
}

/// r of all records one after the other, simulated side by side. False if a simulation failed.
bool run_records(const Plant& plant, const std::vector<FitRecord>& records,
                 const std::vector<InitialState>& initial_states, VectorRef r) {
  std::vector<Matrix> drives;
  std::vector<SimulationTask> tasks;
  drives.reserve(records.size());
  for (std::size_t i = 0; i < records.size(); ++i) {
    drives.push_back(drive_until_end(plant, records[i]));
    tasks.push_back({&plant, &drives.back(), run_options(plant, records[i], initial_states[i])});
  }
  std::vector<Simulation> runs = simulate_measured_side_by_side(tasks);
  Index filled = 0;
  for (std::size_t i = 0; i < records.size(); ++i) {
    const Index count = records[i].y.rows() * (records[i].y.cols() - records[i].skip);
    if (!residual_of(runs[i], records[i], r.segment(filled, count))) return false;
    filled += count;
  }
  return true;
}

class PlantProblem final : public ResidualProblem {
 public:
  PlantProblem(const Plant& plant, const std::vector<FitParameter>& parameters, const std::vector<FitRecord>& records,
               ConstVectorRef state_scale, const Vector& memory_scale = {})
      : plant_(unquantised(plant)), parameters_(parameters), records_(records), state_scale_(state_scale) {
    motions_ = state_scale.size();
    state_scale_.conservativeResize(motions_ + memory_scale.size());
    state_scale_.tail(memory_scale.size()) = memory_scale;
    laws_memories_ = static_cast<Index>(memory_names(plant_).size());
    if (memory_scale.size() > 0) memory_names_ = inner_state_names(plant_);
    const double infinity = std::numeric_limits<double>::infinity();
    box_ = {Vector::Constant(this->parameters(), -infinity), Vector::Constant(this->parameters(), infinity)};
    const Box of_parameters = bounds(plant_, parameters_);
    box_.lower.head(moved()) = of_parameters.lower;
    box_.upper.head(moved()) = of_parameters.upper;
    memory_s_ = memory_s(plant_);
    for (const FitRecord& record : records_) {
      first_.push_back(residuals_);
      residuals_ += record.y.rows() * (record.y.cols() - record.skip);
    }
  }

  /// Nothing else runs beside: columns of a Jacobian are shared out over the threads, for more work in all.
  void run_alone() { alone_ = true; }

  /// Derivatives that the first Jacobian asked for at `theta` takes from another fit instead of computing them.
  void start_from(const PlantFit& other, ConstVectorRef theta) {
    other_ = &other;
    other_theta_ = theta;
  }

  Index moved() const { return static_cast<Index>(parameters_.size()); }
  Index states() const { return state_scale_.size(); }
  Index parameters() const override { return moved() + states() * static_cast<Index>(records_.size()); }
  Index residuals() const override { return residuals_; }
  Box box() const override { return box_; }

  bool residual(ConstVectorRef theta, VectorRef r) const override {
    Plant plant;
    if (!place(theta, plant)) return false;
    std::vector<InitialState> states;
    for (std::size_t i = 0; i < records_.size(); ++i) states.push_back(initial_state(theta, i));
    return run_records(plant, records_, states, r);
  }

  BlockAngular layout() const override {
    std::vector<RowBlock> blocks;
    for (std::size_t i = 0; i < records_.size(); ++i) blocks.push_back({first_[i], length(i), static_cast<Index>(i)});
    if (records_.empty()) return {moved(), 0, 1, {}};
    return {moved(), states(), static_cast<Index>(records_.size()), blocks};
  }

  bool jacobian(ConstVectorRef theta, VectorRef r, MatrixRef J) const override {
    if (records_.size() == 1) return stored_jacobian(theta, r, J);
    Matrix stored(residuals(), moved() + states());
    if (!stored_jacobian(theta, r, stored)) return false;
    J.setZero();
    J.leftCols(moved()) = stored.leftCols(moved());
    for (std::size_t i = 0; i < records_.size(); ++i)
      J.block(first_[i], moved() + states() * static_cast<Index>(i), length(i), states()) =
          stored.block(first_[i], moved(), length(i), states());
    return true;
  }

  bool stored_jacobian(ConstVectorRef theta, VectorRef r, MatrixRef J) const override {
    Plant plant;
    if (!place(theta, plant)) return false;
    J.setZero();
    const bool at_start = other_ && theta == other_theta_;
    std::vector<Index> columns;  // stored: parameters, then the record's own initial state
    for (Index j = 0; j < moved() + states(); ++j)
      if (!at_start || !known_column(j, J)) columns.push_back(j);
    const std::size_t groups =
        alone_ ? std::clamp<std::size_t>(static_cast<std::size_t>(tbb::this_task_arena::max_concurrency()), 1, kGroups)
               : 1;
    std::vector<std::vector<Index>> grouped(groups);
    for (std::size_t k = 0; k < columns.size(); ++k) grouped[k % groups].push_back(columns[k]);
    std::vector<char> ran(records_.size() * groups, 0);
    tbb::parallel_for(std::size_t{0}, ran.size(), [&](std::size_t task) {
      const std::size_t i = task / groups, group = task % groups;
      Vector again;  // every group runs the record, one writes what it leaves
      if (group > 0) again.resize(length(i));
      const auto put = [&](Index column, const Matrix& values) {
        J.col(column).segment(first_[i], length(i)) = values.reshaped();
      };
      ran[task] =
          vary(plant, theta, i, grouped[group], group > 0 ? VectorRef(again) : r.segment(first_[i], length(i)), put);
    });
    return std::find(ran.begin(), ran.end(), 0) == ran.end();
  }

  /// Columns of the only record's Jacobian, so many at a time.
  bool columns(ConstVectorRef theta, Index at_once, VectorRef r, const PutColumn& put) const {
    Plant plant;
    if (!place(theta, plant)) return false;
    for (Index from = 0; from == 0 || from < parameters(); from += at_once) {
      std::vector<Index> some(static_cast<std::size_t>(std::min(at_once, parameters() - from)));
      std::iota(some.begin(), some.end(), from);
      if (!vary(plant, theta, 0, some, r, put)) return false;
    }
    return true;
  }

  bool place(ConstVectorRef theta, Plant& plant) const {
    plant = plant_;
    if (!move_parameters(plant, parameters_, theta)) return false;
    for (const Mass& mass : plant.masses)
      if (!(mass.mass_kg > 0)) return false;
    return true;
  }

  InitialState initial_state(ConstVectorRef theta, std::size_t record) const {
    const Vector whole =
        theta.segment(moved() + states() * static_cast<Index>(record), states()).cwiseProduct(state_scale_);
    InitialState state(whole.head(motions_));
    for (std::size_t k = 0; k < memory_names_.size(); ++k)
      state.memories.emplace_back(memory_names_[k], whole(motions_ + static_cast<Index>(k)));
    return state;
  }

 private:
  Index length(std::size_t i) const { return records_[i].y.rows() * (records_[i].y.cols() - records_[i].skip); }

  bool run(const Plant& plant, ConstVectorRef theta, std::size_t i, VectorRef r) const {
    return run_records(plant, {records_[i]}, {initial_state(theta, i)}, r);
  }

  bool known_column(Index j, MatrixRef J) const {
    const Index known = other_->theta.size(), state = j - moved();
    if (j >= known && state < 0) return false;
    // The other fit's plant may have other inner states.
    if (state >= motions_ && inner_state_names(other_->plant) != memory_names_) return false;
    J.col(j) = other_->jacobian.col(j < known ? j : state + known);
    return true;
  }

  /// A plant one step from theta in a parameter. False where that leaves the bounds or the domain.
  bool neighbour(ConstVectorRef theta, Index j, double step, Plant& plant) const {
    Vector there = theta;
    there(j) += step;
    return there(j) >= box_.lower(j) && there(j) <= box_.upper(j) && place(there, plant);
  }

  /// Residuals of a record and their derivatives (p x scored samples) in given stored columns: toward a larger
  /// parameter, or a smaller one where that step leaves the bounds or the domain.
  bool vary(const Plant& plant, ConstVectorRef theta, std::size_t i, const std::vector<Index>& columns, VectorRef r,
            const PutColumn& put) const {
    std::vector<Index> open = columns;
    if (open.empty()) return run(plant, theta, i, r);
    const FitRecord& record = records_[i];
    const Index kept = record.y.cols() - record.skip;
    for (const double step : {kStep, -kStep}) {
      std::vector<Plant> neighbours(open.size());
      std::vector<Index> asked, left;
      std::vector<Variation> variations;
      for (std::size_t k = 0; k < open.size(); ++k) {
        const Index j = open[k];
        Variation variation{.step = step};
        if (j >= moved()) {
          const Index state = j - moved();
          InitialState change(Vector(Vector::Zero(motions_)));
          if (state < motions_)
            change.motion(state) = state_scale_(state);
          else
            change.memories = {{memory_names_[static_cast<std::size_t>(state - motions_)], state_scale_(state)}};
          if (state >= motions_ + laws_memories_) {  // of a coupling, which is no part of the motion
            const Vector stored = stored_by_sensors(plant, change);
            variation.stored = stored.array().isFinite().select(stored, 0);
            variation.kept_samples = 0;
          } else {
            variation.initial = whole_state(plant, change);
            variation.kept_samples = remembered_samples(plant_, record, memory_s_);
          }
        } else if (neighbour(theta, j, step, neighbours[k])) {
          variation.neighbour = &neighbours[k];
        } else {
          left.push_back(j);
          continue;
        }
        asked.push_back(j);
        variations.push_back(std::move(variation));
      }
      VariedSimulation there =
          simulate_varied(plant, drive_until_end(plant, record), run_options(plant, record, initial_state(theta, i)),
                          std::move(variations));
      if (!residual_of(there.simulation, record, r)) return false;
      for (std::size_t k = 0; k < asked.size(); ++k) {
        as_logged(record.slow, there.outputs[k]);
        const Matrix values =
            record.weight_std.cwiseInverse().asDiagonal() * there.outputs[k].middleCols(record.skip, kept);
        put(asked[k], values);
        if (!there.defined[k] || !values.allFinite()) left.push_back(asked[k]);
      }
      if (left.empty()) return true;
      open = left;
    }
    return false;
  }

  Plant plant_;
  std::vector<FitParameter> parameters_;
  std::vector<FitRecord> records_;
  Vector state_scale_;                     // of [q; v], then of the inner states
  Index motions_ = 0;                      // of these, [q; v]
  std::vector<std::string> memory_names_;  // of those that are free
  Index laws_memories_ = 0;                // of these, those of laws
  Box box_;
  double memory_s_ = 0;
  std::vector<Index> first_;
  Index residuals_ = 0;
  bool alone_ = false;
  const PlantFit* other_ = nullptr;
  Vector other_theta_;
};

/// Initial state of a record whose drive never moves, such as a free decay: the one of least squares, linearised around
/// rest. Rest itself where the readings do not tell it. A plant with friction
/// sticks at rest, so that linearised there it says nothing of its motion: where the estimate leaves more than the
/// linear plant foretold, the state is fitted to the beginning of the record instead, and from there to longer and
/// longer beginnings. @param rest [q; v] [m, m/s]   @return likewise. Cost: some fits of the states of one record
Vector free_start(const Plant& plant, const FitRecord& record, const Vector& rest, const Solver& solver) {
  const FitRecord part = remembered_part(plant, {record}).front();
  Matrix J(part.y.rows() * (part.y.cols() - part.skip), rest.size());
  Vector r;
  if (!record_derivatives(plant, {}, part, Vector::Ones(rest.size()), rest, r,
                          [&](Index column, const Matrix& values) { J.col(column) = values.reshaped(); }))
    return rest;
  const Vector size = J.colwise().norm().cwiseMax(std::numeric_limits<double>::min());
  const Eigen::CompleteOrthogonalDecomposition<Matrix> least_squares(J * size.cwiseInverse().asDiagonal());
  const Vector step = least_squares.solve(r).cwiseQuotient(size), linear = rest - step;
  const double foretold = (r - J * step).squaredNorm();
  const auto leaves = [&](const Vector& state) {
    Vector left;
    return plant_residual(plant, {part}, {InitialState(state)}, left) ? left.squaredNorm()
                                                                      : std::numeric_limits<double>::infinity();
  };
  const double left = leaves(linear);
  if (left <= kAsForetold * foretold) return linear;
  Vector grown = rest;
  for (Index samples = kBeginning * rest.size();; samples *= 2) {
    FitRecord beginning = part;
    beginning.skip = 0;  // a drive that never moves is known from the first sample on
    beginning.y.conservativeResize(Eigen::NoChange, std::min(samples, part.y.cols()));
    const PlantProblem problem(plant, {}, {beginning}, Vector::Ones(rest.size()));
    const Solution solution = solver.minimise(problem, grown, kStartIterations);
    if (solution.theta.size() == grown.size() && solution.theta.allFinite()) grown = solution.theta;
    if (beginning.y.cols() == part.y.cols()) break;
  }
  return leaves(grown) < left ? grown : linear;
}

/// States of a plant under its records: their sizes, and in these where each record may begin, 2n a record.
struct TypicalStates {
  Vector scale;  ///< 2n: RMS under the drives, or what a free decay begins with
  Vector rest;   ///< in equilibrium
  Vector begin;  ///< the same, or the state of `free_start` where a drive never moves
};

/// What a state of this plant is in size under its drives, seen in a simulation from rest. None where one fails.
std::optional<TypicalStates> typical_states(const Plant& plant, const std::vector<FitRecord>& records,
                                            const Solver& solver) {
  const Index n2 = 2 * plant.mass_count(), count = static_cast<Index>(records.size());
  TypicalStates typical{Vector::Zero(n2), Vector(n2 * count), Vector(n2 * count)};
  Vector& scale = typical.scale;
  for (std::size_t i = 0; i < records.size(); ++i) {
    const Simulation result = simulate_measured(plant, records[i].drive, run_options(plant, records[i]));
    if (result.status != Status::ok) return {};
    scale = scale.cwiseMax(rms(result.states.topRows(n2)));
    const Vector rest = result.states.col(0).head(n2);
    const Vector begin = n2 > 0 && never_moves(records[i].drive) ? free_start(plant, records[i], rest, solver) : rest;
    typical.rest.segment(n2 * static_cast<Index>(i), n2) = rest;
    typical.begin.segment(n2 * static_cast<Index>(i), n2) = begin;
    scale = scale.cwiseMax((begin - rest).cwiseAbs());
    for (const auto& [state, value] : known_states(plant, records[i].start, rest))
      scale(state) = std::max(scale(state), std::abs(value - rest(state)));
  }
  if (n2 == 0) return typical;  // all nodes are held
  // A mass that never moves still needs a scale.
  scale = scale.cwiseMax(1e-9 + 1e-6 * scale.maxCoeff());
  typical.rest = typical.rest.cwiseQuotient(scale.replicate(count, 1));
  typical.begin = typical.begin.cwiseQuotient(scale.replicate(count, 1));
  return typical;
}

/// Initial states of the records of a fit. @param motions [q; v] of each, in the fit's scales
std::vector<InitialState> initial_states(const PlantFit& fit, const std::vector<FitRecord>& records,
                                         const Vector& motions) {
  std::vector<InitialState> list;
  const Index states = fit.state_scale.size();
  for (std::size_t i = 0; i < records.size(); ++i) {
    const Vector motion = motions.segment(states * static_cast<Index>(i), states);
    list.push_back(with_stored(fit.plant, records[i], Vector(motion.cwiseProduct(fit.state_scale))));
  }
  return list;
}

/// Initial states as a problem counts them: of each record [q; v], then its memories, in their scales.
Vector packed(const PlantFit& fit, const std::vector<InitialState>& list) {
  const Index motions = fit.state_scale.size(), memories = fit.memory_scale.size();
  Vector all((motions + memories) * static_cast<Index>(list.size()));
  Index filled = 0;
  for (const InitialState& state : list) {
    all.segment(filled, motions) = state.motion.cwiseQuotient(fit.state_scale);
    filled += motions;
    if (memories == 0) continue;
    all.segment(filled, memories) = memories_of(fit.plant, state).cwiseQuotient(fit.memory_scale);
    filled += memories;
  }
  return all;
}

/// Initial states that records tell are where these say, and stay there.
/// @param mean, start, precision as `packed`
void hold_known(const PlantFit& fit, const std::vector<FitRecord>& records, Vector& mean, Vector& start,
                Vector& precision) {
  const Index motions = fit.state_scale.size(), own = motions + fit.memory_scale.size();
  for (std::size_t i = 0; i < records.size(); ++i) {
    const Index first = own * static_cast<Index>(i);
    const auto hold = [&](Index state, double value) {
      mean(first + state) = start(first + state) = value;
      precision(first + state) = fit.dispersion / (kKnownSpread * kKnownSpread);
    };
    const Vector rest = fit.states_at_rest.segment(motions * static_cast<Index>(i), motions);
    for (const auto& [state, value] : known_states(fit.plant, records[i].start, rest.cwiseProduct(fit.state_scale)))
      hold(state, value / fit.state_scale(state));
    if (records[i].start.rest)
      for (Index state = motions; state < own; ++state) hold(state, mean(first + state));
  }
}

/// Adds operating points of a record, evenly over the samples that are scored.
void visit(const Simulation& result, const FitRecord& record, Matrix& visited) {
  const Index N = result.states.rows(), m = record.drive.rows(), scored = record.y.cols() - record.skip;
  const Index count = std::min(kVisited, scored), before = visited.cols();
  visited.conservativeResize(N + m, before + count);
  for (Index k = 0; k < count; ++k) {
    const Index sample = record.skip + k * scored / count;
    visited.col(before + k) << result.states.col(sample), record.drive.col(sample * record.ratio);
  }
}

/// What a solver finds; the problem as it stands where nothing can be moved, as of a plant without masses.
Solution solved(const Solver& solver, const ResidualProblem& problem, ConstVectorRef theta, Index iterations) {
  if (problem.parameters() > 0) return solver.minimise(problem, theta, iterations);
  Solution fixed;
  fixed.theta = theta;
  fixed.status = problem.cost(theta, fixed.cost) ? Status::ok : Status::outside_domain;
  return fixed;
}

Vector scored_residual(const std::vector<Matrix>& errors, const std::vector<FitRecord>& records) {
  Index total = 0, filled = 0;
  for (const FitRecord& record : records) total += record.y.rows() * (record.y.cols() - record.skip);
  Vector residual(total);
  for (std::size_t i = 0; i < records.size(); ++i) {
    const Index kept = records[i].y.cols() - records[i].skip, count = records[i].y.rows() * kept;
    residual.segment(filled, count).reshaped(records[i].y.rows(), kept) =
        records[i].weight_std.cwiseInverse().asDiagonal() * errors[i].rightCols(kept);
    filled += count;
  }
  return residual;
}

}  // namespace

std::vector<FitParameter> tolerance_parameters(const Plant& plant) {
  std::vector<FitParameter> list;
  for (const PlantParameter& parameter : plant_parameters(plant))
    if (parameter.value != 0 && !parameter.follows)
      list.push_back({parameter.name, parameter.tolerance * std::abs(parameter.value), 1});
  return list;
}

std::unique_ptr<ResidualProblem> plant_problem(const Plant& plant, const std::vector<FitParameter>& parameters,
                                               const std::vector<FitRecord>& records, ConstVectorRef state_scale,
                                               const Vector& memory_scale) {
  return std::make_unique<PlantProblem>(plant, parameters, records, state_scale, memory_scale);
}

bool record_derivatives(const Plant& plant, const std::vector<FitParameter>& parameters, const FitRecord& record,
                        ConstVectorRef state_scale, ConstVectorRef initial_state, Vector& residual,
                        const PutColumn& put) {
  const PlantProblem problem(plant, parameters, {record}, state_scale);
  Vector theta = Vector::Zero(problem.parameters());
  theta.tail(initial_state.size()) = initial_state.cwiseQuotient(state_scale);
  residual.resize(problem.residuals());
  const double column_bytes = sizeof(double) * static_cast<double>(record.y.size());
  return problem.columns(theta, std::max(kLeastAtOnce, static_cast<Index>(kAtOnceBytes / column_bytes)), residual, put);
}

bool plant_residual(const Plant& plant, const std::vector<FitRecord>& records,
                    const std::vector<InitialState>& initial_states, Vector& residual) {
  Index total = 0;
  for (const FitRecord& record : records) total += record.y.rows() * (record.y.cols() - record.skip);
  residual.resize(total);
  return run_records(plant, records, initial_states, residual);
}

PlantFit fit_plant(const Plant& plant, const std::vector<FitParameter>& parameters,
                   const std::vector<FitRecord>& records, const Solver& solver, const FitOptions& options) {
  PlantFit fit;
  fit.plant = plant;
  std::vector<InitialState> begin, resting;
  if (options.from) {
    fit.state_scale = options.from->state_scale;
    fit.states_at_rest = options.from->states_at_rest;
    for (std::size_t i = 0; i < records.size(); ++i)
      begin.push_back(with_stored(plant, records[i], options.from->initial_states[i]));
    resting = initial_states(fit, records, fit.states_at_rest);
  } else if (const std::optional<TypicalStates> typical = typical_states(plant, records, solver)) {
    fit.state_scale = typical->scale;
    fit.states_at_rest = typical->rest;
    begin = initial_states(fit, records, typical->begin);
    resting = initial_states(fit, records, typical->rest);
  } else {
    fit.solution.status = Status::outside_domain;
    fit.solution.message = "the plant as delivered cannot follow the drive";
    return fit;
  }
  const bool same = options.from && inner_state_names(options.from->plant) == inner_state_names(plant);
  fit.memory_scale = same ? options.from->memory_scale : typical_inner_states(plant, records, begin);
  fit.dispersion = records.empty() ? 1 : records.front().dispersion;
  Vector rest = packed(fit, resting), start = packed(fit, begin);
  Vector state_precision = Vector::Constant(start.size(), fit.dispersion / (kStateSpread * kStateSpread));
  hold_known(fit, records, rest, start, state_precision);
  if (!options.from) {
    // The start of a record says little of the state there, and a wrong plant would bend it: it stays among those that
    // the drive makes.
    const PlantProblem states_alone(plant, {}, remembered_part(plant, records), fit.state_scale, fit.memory_scale);
    const Solution first = solved(solver, *with_prior(states_alone, start, state_precision), start, options.iterations);
    if (first.status != Status::outside_domain) start = first.theta;
  }
  const bool states_only = parameters.empty();
  PlantProblem problem(plant, parameters, states_only ? remembered_part(plant, records) : records, fit.state_scale,
                       fit.memory_scale);
  const Index moved = problem.moved();
  Vector theta(problem.parameters()), mean = Vector::Zero(problem.parameters());
  theta << (options.theta.size() == moved ? options.theta : Vector(Vector::Zero(moved))), start;
  theta = clamped(theta, problem.box());
  mean.tail(start.size()) = rest;
  fit.precision = Vector::Zero(problem.parameters());
  fit.precision.tail(start.size()) = state_precision;
  for (Index i = 0; i < moved; ++i) {
    const double std = parameters[static_cast<std::size_t>(i)].prior_std;
    if (std > 0) fit.precision(i) = fit.dispersion / (std * std);
  }
  if (options.alone) problem.run_alone();
  if (options.from && options.from->jacobian.size() > 0 && !states_only) problem.start_from(*options.from, theta);
  fit.solution = solved(solver, *with_prior(problem, mean, fit.precision), theta, options.iterations);
  if (fit.solution.status == Status::outside_domain) return fit;
  theta = fit.solution.theta;
  fit.theta = theta.head(moved);
  fit.deviation = theta - mean;
  move_parameters(fit.plant, parameters, fit.theta);
  for (std::size_t i = 0; i < records.size(); ++i) {
    const FitRecord& record = records[i];
    fit.initial_states.push_back(problem.initial_state(theta, i));
    Simulation result =
        simulate_measured(fit.plant, record.drive, run_options(fit.plant, record, fit.initial_states.back()));
    if (result.status != Status::ok) {
      fit.solution.status = result.status;
      fit.solution.message = result.message;
      fit.error.clear();
      return fit;
    }
    as_logged(record.slow, result.outputs);
    fit.error.push_back(result.outputs.leftCols(record.y.cols()) - record.y);
    visit(result, record, fit.visited);
  }
  fit.residual = scored_residual(fit.error, records);
  fit.misfit = fit.residual.squaredNorm() / static_cast<double>(fit.residual.size());
  if (options.linearise && !linearise(fit, parameters, records)) {
    fit.solution.status = Status::outside_domain;
    fit.solution.message = "linearisation failed at the solution";
    fit.error.clear();
  }
  return fit;
}

bool linearise(PlantFit& fit, const std::vector<FitParameter>& parameters, const std::vector<FitRecord>& records) {
  // About the fitted plant the parameters count from zero, in the same scales.
  const PlantProblem problem(fit.plant, parameters, records, fit.state_scale, fit.memory_scale);
  const Index moved = problem.moved();
  Vector theta(problem.parameters());
  theta << Vector::Zero(moved), packed(fit, fit.initial_states);
  fit.layout = problem.layout();
  fit.jacobian.resize(problem.residuals(), fit.layout.stored());
  if (!problem.stored_jacobian(theta, fit.residual, fit.jacobian)) return false;
  fit.covariance.resize(moved, moved);
  if (problem.parameters() == 0) return true;
  Matrix H = fit.layout.lower_gram(fit.jacobian);
  H.diagonal() += fit.precision;
  fit.covariance = Eigen::LDLT<Matrix, Eigen::Lower>(H)
                       .solve(Matrix::Identity(problem.parameters(), problem.parameters()))
                       .topLeftCorner(moved, moved) *
                   fit.dispersion;
  return true;
}

}  // namespace wheelhop
