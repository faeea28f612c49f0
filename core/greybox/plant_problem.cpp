#include "core/greybox/plant_problem.hpp"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "core/data/slow_channels.hpp"
#include "core/greybox/inner_states.hpp"
#include "core/plant/dataset.hpp"
#include "core/plant/linearise.hpp"
#include "core/plant/simulate.hpp"

namespace wheelhop {
namespace {

/// Step of the differences, in scales: a tolerance or a typical state is about one, and laws bend within it.
constexpr double kStep = 1e-4;
constexpr double kRounding = 1e-9;       // of a scale
constexpr std::size_t kGroups = 4;       // of the columns of a Jacobian: each group simulates the plant once more
constexpr double kAtOnceBytes = 2.56e8;  // of columns that are computed beside one another, where all are not kept
constexpr Index kLeastAtOnce = 16;       // whatever their size: a further pass simulates the plant once more
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

}  // namespace

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

std::vector<FitRecord> remembered_part(const Plant& plant, std::vector<FitRecord> records) {
  double memory = memory_s(plant);
  for (const Sensor& sensor : plant.sensors)
    if (sensor.path.high_pass_hz > 0)
      memory = std::max(memory, kForgotten / (2 * std::numbers::pi * sensor.path.high_pass_hz));
  for (FitRecord& record : records)
    record.y.conservativeResize(Eigen::NoChange, remembered_samples(plant, record, memory));
  return records;
}

PlantProblem::PlantProblem(const Plant& plant, const std::vector<FitParameter>& parameters,
                           const std::vector<FitRecord>& records, ConstVectorRef state_scale,
                           const Vector& memory_scale)
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

bool PlantProblem::residual(ConstVectorRef theta, VectorRef r) const {
  Plant plant;
  if (!place(theta, plant)) return false;
  std::vector<InitialState> states;
  for (std::size_t i = 0; i < records_.size(); ++i) states.push_back(initial_state(theta, i));
  return run_records(plant, records_, states, r);
}

BlockAngular PlantProblem::layout() const {
  std::vector<RowBlock> blocks;
  for (std::size_t i = 0; i < records_.size(); ++i) blocks.push_back({first_[i], length(i), static_cast<Index>(i)});
  if (records_.empty()) return {moved(), 0, 1, {}};
  return {moved(), states(), static_cast<Index>(records_.size()), blocks};
}

bool PlantProblem::jacobian(ConstVectorRef theta, VectorRef r, MatrixRef J) const {
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

bool PlantProblem::stored_jacobian(ConstVectorRef theta, VectorRef r, MatrixRef J) const {
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

bool PlantProblem::columns(ConstVectorRef theta, Index at_once, VectorRef r, const PutColumn& put) const {
  Plant plant;
  if (!place(theta, plant)) return false;
  for (Index from = 0; from == 0 || from < parameters(); from += at_once) {
    std::vector<Index> some(static_cast<std::size_t>(std::min(at_once, parameters() - from)));
    std::iota(some.begin(), some.end(), from);
    if (!vary(plant, theta, 0, some, r, put)) return false;
  }
  return true;
}

bool PlantProblem::place(ConstVectorRef theta, Plant& plant) const {
  plant = plant_;
  if (!move_parameters(plant, parameters_, theta)) return false;
  for (const Mass& mass : plant.masses)
    if (!(mass.mass_kg > 0)) return false;
  return true;
}

InitialState PlantProblem::initial_state(ConstVectorRef theta, std::size_t record) const {
  const Vector whole =
      theta.segment(moved() + states() * static_cast<Index>(record), states()).cwiseProduct(state_scale_);
  InitialState state(whole.head(motions_));
  for (std::size_t k = 0; k < memory_names_.size(); ++k)
    state.memories.emplace_back(memory_names_[k], whole(motions_ + static_cast<Index>(k)));
  return state;
}

bool PlantProblem::run(const Plant& plant, ConstVectorRef theta, std::size_t i, VectorRef r) const {
  return run_records(plant, {records_[i]}, {initial_state(theta, i)}, r);
}

bool PlantProblem::known_column(Index j, MatrixRef J) const {
  const Index known = other_->theta.size(), state = j - moved();
  if (j >= known && state < 0) return false;
  // The other fit's plant may have other inner states.
  if (state >= motions_ && inner_state_names(other_->plant) != memory_names_) return false;
  J.col(j) = other_->jacobian.col(j < known ? j : state + known);
  return true;
}

/// A plant one step from theta in a parameter. False where that leaves the bounds or the domain.
bool PlantProblem::neighbour(ConstVectorRef theta, Index j, double step, Plant& plant) const {
  Vector there = theta;
  there(j) += step;
  return there(j) >= box_.lower(j) && there(j) <= box_.upper(j) && place(there, plant);
}

/// Residuals of a record and their derivatives (p x scored samples) in given stored columns: toward a larger
/// parameter, or a smaller one where that step leaves the bounds or the domain.
bool PlantProblem::vary(const Plant& plant, ConstVectorRef theta, std::size_t i, const std::vector<Index>& columns,
                        VectorRef r, const PutColumn& put) const {
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

}  // namespace wheelhop
