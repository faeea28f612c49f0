#include "core/gap/plant_fit.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <cmath>

#include "core/data/metrics.hpp"
#include "core/data/resample.hpp"
#include "core/identify/prior.hpp"
#include "core/plant/dataset.hpp"
#include "core/plant/simulate.hpp"

namespace wheelhop {
namespace {

/// Steps of the central differences, in scales: a tolerance or a typical state is about one, and laws bend within it.
constexpr double kStep = 1e-3;

class PlantProblem final : public ResidualProblem {
 public:
  PlantProblem(const Plant& plant, const std::vector<FitParameter>& parameters, const std::vector<FitRecord>& records,
               ConstVectorRef state_scale)
      : plant_(plant), parameters_(parameters), records_(records), state_scale_(state_scale) {
    for (const FitParameter& parameter : parameters_) start_.push_back(get_parameter(plant_, parameter.name));
    for (const FitRecord& record : records_) {
      first_.push_back(residuals_);
      residuals_ += record.y.rows() * (record.y.cols() - record.skip);
    }
  }

  Index moved() const { return static_cast<Index>(parameters_.size()); }
  Index states() const { return state_scale_.size(); }
  Index parameters() const override { return moved() + states() * static_cast<Index>(records_.size()); }
  Index residuals() const override { return residuals_; }

  bool residual(ConstVectorRef theta, VectorRef r) const override {
    Plant plant;
    if (!place(theta, plant)) return false;
    for (std::size_t i = 0; i < records_.size(); ++i)
      if (!run(plant, theta, i, r.segment(first_[i], length(i)))) return false;
    return true;
  }

  bool jacobian(ConstVectorRef theta, VectorRef r, MatrixRef J) const override {
    if (!residual(theta, r)) return false;
    J.setZero();
    std::vector<char> done(static_cast<std::size_t>(parameters()), 0);
    tbb::parallel_for(tbb::blocked_range<Index>(0, parameters(), 1), [&](const tbb::blocked_range<Index>& range) {
      for (Index j = range.begin(); j != range.end(); ++j) done[static_cast<std::size_t>(j)] = column(theta, r, j, J);
    });
    return std::find(done.begin(), done.end(), 0) == done.end();
  }

  bool place(ConstVectorRef theta, Plant& plant) const {
    plant = plant_;
    for (std::size_t i = 0; i < parameters_.size(); ++i) {
      const double value = start_[i] + theta(static_cast<Index>(i)) * parameters_[i].scale;
      if (!std::isfinite(value) || value * start_[i] < 0) return false;
      set_parameter(plant, parameters_[i].name, value);
    }
    for (const Mass& mass : plant.masses)
      if (!(mass.mass_kg > 0)) return false;
    return true;
  }

  Vector initial_state(ConstVectorRef theta, std::size_t record) const {
    return theta.segment(moved() + states() * static_cast<Index>(record), states()).cwiseProduct(state_scale_);
  }

 private:
  Index length(std::size_t i) const { return records_[i].y.rows() * (records_[i].y.cols() - records_[i].skip); }

  bool run(const Plant& plant, ConstVectorRef theta, std::size_t i, VectorRef r) const {
    const FitRecord& record = records_[i];
    const Simulation result =
        simulate_measured(plant, record.drive, {.decimation = record.ratio, .initial_state = initial_state(theta, i)});
    if (result.status != Status::ok) return false;
    const Index kept = record.y.cols() - record.skip;
    r.reshaped(record.y.rows(), kept) = record.weight_std.cwiseInverse().asDiagonal() *
                                        (result.outputs.leftCols(record.y.cols()) - record.y).rightCols(kept);
    return r.allFinite();
  }

  /// Central difference; one-sided where one side leaves the domain.
  bool column(ConstVectorRef theta, ConstVectorRef r, Index j, MatrixRef J) const {
    Vector moved_theta = theta, up(residuals_), down(residuals_);
    const auto side = [&](double step, VectorRef out) {
      moved_theta(j) = theta(j) + step;
      Plant plant;
      if (!place(moved_theta, plant)) return false;
      for (std::size_t i = 0; i < records_.size(); ++i)
        if (concerns(j, i) && !run(plant, moved_theta, i, out.segment(first_[i], length(i)))) return false;
      return true;
    };
    const bool above = side(kStep, up), below = side(-kStep, down);
    if (!above && !below) return false;
    for (std::size_t i = 0; i < records_.size(); ++i) {
      if (!concerns(j, i)) continue;
      const Index from = first_[i], count = length(i);
      if (above && below)
        J.col(j).segment(from, count) = (up.segment(from, count) - down.segment(from, count)) / (2 * kStep);
      else if (above)
        J.col(j).segment(from, count) = (up.segment(from, count) - r.segment(from, count)) / kStep;
      else
        J.col(j).segment(from, count) = (r.segment(from, count) - down.segment(from, count)) / kStep;
    }
    return true;
  }

  /// A parameter moves every record, an initial state its own.
  bool concerns(Index j, std::size_t record) const {
    return j < moved() || (j - moved()) / states() == static_cast<Index>(record);
  }

  Plant plant_;
  std::vector<FitParameter> parameters_;
  std::vector<FitRecord> records_;
  Vector state_scale_;
  std::vector<double> start_;
  std::vector<Index> first_;
  Index residuals_ = 0;
};

/// What a state of this plant is in size under its drives, seen in a simulation from rest.
bool typical_states(const Plant& plant, const std::vector<FitRecord>& records, Vector& scale, Vector& start) {
  const Index n2 = 2 * plant.mass_count();
  scale = Vector::Zero(n2);
  start.resize(n2 * static_cast<Index>(records.size()));
  for (std::size_t i = 0; i < records.size(); ++i) {
    const Simulation result =
        simulate_measured(plant, records[i].drive, {.decimation = records[i].ratio, .from_equilibrium = true});
    if (result.status != Status::ok) return false;
    scale = scale.cwiseMax(rms(result.states.topRows(n2)));
    start.segment(n2 * static_cast<Index>(i), n2) = result.states.col(0).head(n2);
  }
  // A mass that never moves still needs a scale.
  scale = scale.cwiseMax(1e-9 + 1e-6 * scale.maxCoeff());
  start = start.cwiseQuotient(scale.replicate(static_cast<Index>(records.size()), 1));
  return true;
}

}  // namespace

std::vector<FitParameter> tolerance_parameters(const Plant& plant) {
  std::vector<FitParameter> list;
  for (const PlantParameter& parameter : plant_parameters(plant))
    if (parameter.value != 0) list.push_back({parameter.name, parameter.tolerance * std::abs(parameter.value), 1});
  return list;
}

FitRecord fit_record(const Plant& plant, const Signal& signal, ConstVectorRef weight_std) {
  FitRecord record;
  const double sampling_hz = 1 / signal.sample_time_s;
  record.ratio = hold_samples_per_record_sample(plant, sampling_hz);
  const Matrix u = drive_of_record(plant, signal);
  record.drive.resize(u.rows(), u.cols() * record.ratio);
  for (Index i = 0; i < u.rows(); ++i)
    record.drive.row(i) = interpolate(u.row(i), record.ratio,
                                      interpolation_from(plant.inputs[static_cast<std::size_t>(i)].interpolation));
  record.y = signal.y;
  record.skip = signal.skip;
  record.weight_std = weight_std;
  return record;
}

std::unique_ptr<ResidualProblem> plant_problem(const Plant& plant, const std::vector<FitParameter>& parameters,
                                               const std::vector<FitRecord>& records, ConstVectorRef state_scale) {
  return std::make_unique<PlantProblem>(plant, parameters, records, state_scale);
}

PlantFit fit_plant(const Plant& plant, const std::vector<FitParameter>& parameters,
                   const std::vector<FitRecord>& records, const Solver& solver, Index iterations) {
  PlantFit fit;
  fit.plant = plant;
  Vector scale, start;
  if (!typical_states(plant, records, scale, start)) {
    fit.solution.status = Status::outside_domain;
    fit.solution.message = "the plant as delivered cannot follow the drive";
    return fit;
  }
  const PlantProblem states_alone(plant, {}, records, scale);
  const Solution first = solver.minimise(states_alone, start, iterations);
  const PlantProblem problem(plant, parameters, records, scale);
  const Index moved = problem.moved();
  Vector theta(problem.parameters()), precision = Vector::Zero(problem.parameters());
  theta << Vector::Zero(moved), first.status == Status::outside_domain ? start : first.theta;
  for (Index i = 0; i < moved; ++i) {
    const double std = parameters[static_cast<std::size_t>(i)].prior_std;
    if (std > 0) precision(i) = 1 / (std * std);
  }
  const auto posterior = with_prior(problem, Vector::Zero(theta.size()), precision);
  fit.solution = solver.minimise(*posterior, theta, iterations);
  if (fit.solution.status == Status::outside_domain) return fit;
  theta = fit.solution.theta;
  fit.theta = theta.head(moved);
  problem.place(theta, fit.plant);

  double cost = 0;
  Vector gradient;
  Matrix H;
  if (posterior->normal_equations(theta, cost, gradient, H)) {
    const Matrix full = H.selfadjointView<Eigen::Lower>();
    fit.covariance = full.ldlt().solve(Matrix::Identity(full.rows(), full.cols())).topLeftCorner(moved, moved);
  }
  Vector r(problem.residuals());
  if (!problem.residual(theta, r)) return fit;
  fit.misfit = r.squaredNorm() / static_cast<double>(r.size());
  for (std::size_t i = 0; i < records.size(); ++i) {
    const FitRecord& record = records[i];
    fit.initial_states.push_back(problem.initial_state(theta, i));
    const Simulation result = simulate_measured(
        fit.plant, record.drive, {.decimation = record.ratio, .initial_state = fit.initial_states.back()});
    fit.error.push_back(result.outputs.leftCols(record.y.cols()) - record.y);
  }
  return fit;
}

}  // namespace wheelhop
