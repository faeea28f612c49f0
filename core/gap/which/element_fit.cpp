#include "core/gap/which/element_fit.hpp"

#include <tbb/parallel_for.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/plant/simulate.hpp"

namespace wheelhop {
namespace {

constexpr Index kSteps = 4, kMostSteps = 64;  // of a simulation between two samples
constexpr double kNothing = 1e-9;             // of a column, which is round-off
constexpr Index kIterations = 20;             // of a fit of one element: a judgement, a bound on the time

/// Force of an element [N] along a prescribed travel, as a dynamometer measures it. False outside its domain.
bool force_along(const Element& element, const Matrix& travel, double sampling_hz, Vector& force) {
  Plant bench;
  bench.name = "bench";
  PlantInput ram;
  ram.name = "ram";
  ram.unit = "m";
  ram.hold_hz = sampling_hz;
  ram.held = false;
  bench.inputs = {ram};
  bench.elements = {element};
  bench.elements.front().from = "ground";
  bench.elements.front().to = ram.name;
  Sensor cell;
  cell.name = "cell";
  cell.kind = SensorKind::force;
  cell.unit = "N";
  cell.element = element.name;
  bench.sensors = {cell};
  SimulateOptions options;
  options.substeps = kSteps;
  options.most_substeps = kMostSteps;
  const Simulation run = simulate(bench, travel, options);
  if (run.status != Status::ok || !all_finite(run.outputs)) return false;
  force = run.outputs.row(0).transpose();
  return true;
}

/// Parameters of laws that a fit to the force moves, and their place in the study's list of tolerances.
struct OfPlace {
  std::vector<FitParameter> parameters;
  std::vector<std::size_t> number;
};

OfPlace tolerances_at(const Study& study, const Place& location) {
  OfPlace out;
  for (const PlantParameter& known : plant_parameters(study.nominal)) {
    if (known.handle.place != location) continue;
    for (std::size_t i = 0; i < study.tolerances.size(); ++i)
      if (study.tolerances[i].name == known.name) {
        out.parameters.push_back(study.tolerances[i]);
        out.number.push_back(i);
      }
  }
  return out;
}

/// The element of a candidate fitted to the force there: r = (F(theta) - F) / |F's unknown part|, then kHome theta of
/// the tolerances. theta: those of the place, then the candidate's own parameters, in scales.
class ElementProblem final : public ResidualProblem {
 public:
  ElementProblem(const ForceThere& known_force, const EffectCandidate& candidate, const std::vector<FitParameter>& own,
                 double unknown)
      : there_(known_force),
        candidate_(candidate),
        parameters_(own),
        homes_(static_cast<Index>(own.size())),
        unknown_(unknown) {
    parameters_.insert(parameters_.end(), candidate.parameters.begin(), candidate.parameters.end());
  }
  Index parameters() const override { return static_cast<Index>(parameters_.size()); }
  Index residuals() const override { return there_.force.size() + homes_; }
  Box box() const override {
    Box box{Vector(parameters()), Vector(parameters())};
    const std::vector<PlantParameter> known = plant_parameters(candidate_.plant);
    for (Index i = 0; i < parameters(); ++i) {
      const FitParameter& own = parameters_[static_cast<std::size_t>(i)];
      const double start = get_parameter(candidate_.plant, own.name), infinity = kFarthest * 1e3;
      Range range{-std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
      for (const PlantParameter& parameter : known)
        if (parameter.name == own.name) range = parameter.range;
      range.low = std::max(range.low, own.least);
      const double most = i < homes_ ? kFarthest : infinity;
      box.lower(i) = std::min(std::max((range.low - start) / own.scale, -most), 0.0);
      box.upper(i) = std::max(std::min((range.high - start) / own.scale, most), 0.0);
    }
    return box;
  }
  Plant plant(ConstVectorRef theta) const {
    Plant plant = candidate_.plant;
    for (std::size_t i = 0; i < parameters_.size(); ++i)
      set_parameter(plant, parameters_[i].name,
                    get_parameter(plant, parameters_[i].name) + theta(static_cast<Index>(i)) * parameters_[i].scale);
    return plant;
  }
  bool residual(ConstVectorRef theta, VectorRef r) const override {
    const Plant moved = plant(theta);
    Vector force;
    if (!there_.along(*element_at(moved, candidate_.location), force)) return false;
    r.head(force.size()) = (force - there_.force) / unknown_;
    r.tail(homes_) = kHome * theta.head(homes_);
    return r.allFinite();
  }
  bool jacobian(ConstVectorRef theta, VectorRef r, MatrixRef J) const override {
    if (!residual(theta, r)) return false;
    const Box bounds = box();
    for (Index j = 0; j < parameters(); ++j) {
      Vector moved = theta, there(residuals());
      const double step = theta(j) + kStep <= bounds.upper(j) ? kStep : -kStep;
      moved(j) += step;
      if (!residual(moved, there)) return false;
      J.col(j) = (there - r) / step;
    }
    return true;
  }

 private:
  static constexpr double kStep = 1e-4;  // of a scale
  static constexpr double kHome = 0.02;  // a judgement: what a tolerance is worth, of the size of the unknown force
  const ForceThere& there_;
  const EffectCandidate& candidate_;
  std::vector<FitParameter> parameters_;
  Index homes_;
  double unknown_;
};

/// What of values is left beyond columns.
class Beyond {
 public:
  explicit Beyond(Matrix columns) : columns_(std::move(columns)) {
    if (columns_.cols() > 0) qr_.compute(columns_);
  }
  Vector operator()(const Vector& values) const {
    return columns_.cols() == 0 ? values : Vector(values - columns_ * qr_.solve(values));
  }

 private:
  Matrix columns_;
  Eigen::ColPivHouseholderQR<Matrix> qr_;
};

/// Share of a force that a candidate's law makes near its typical size: by that force, and by what the law's other
/// parameters change of it to first order, as several of one polynomial may have any signs.
/// @param known force of the laws that are there without it   @param beyond, force what re-tuning cannot make
double share_made(const EffectCandidate& candidate, const ForceThere& there, const Vector& known, const Place& location,
                  const Beyond& beyond, const Vector& force) {
  const auto count = static_cast<Index>(candidate.parameters.size());
  Matrix columns(force.size(), count);
  Vector made, changed;
  if (!there.along(*element_at(candidate.plant, location), made)) return 0;
  columns.col(0) = beyond(made - known);
  if (!(columns.col(0).squaredNorm() > kNothing * (made - known).squaredNorm())) return 0;
  for (Index k = 1; k < count; ++k) {
    Plant moved = candidate.plant;
    const FitParameter& parameter = candidate.parameters[static_cast<std::size_t>(k)];
    set_parameter(moved, parameter.name, get_parameter(moved, parameter.name) + parameter.scale);
    if (!there.along(*element_at(moved, location), changed)) return 0;
    columns.col(k) = beyond(changed - made);
  }
  const double power = force.squaredNorm();
  const Vector weights = columns.colPivHouseholderQr().solve(force);
  if (weights(0) > 0 || candidate.either_sign) return 1 - (force - columns * weights).squaredNorm() / power;
  const double common = columns.col(0).dot(force);
  return common > 0 ? common * common / (columns.col(0).squaredNorm() * power) : 0;
}

}  // namespace

const Element* element_at(const Plant& plant, const Place& location) {
  for (const Element& element : plant.elements)
    if (location_of(element) == location) return &element;
  return nullptr;
}

bool ForceThere::along(const Element& element, Vector& along_it) const {
  std::vector<Vector> forces(motion.size());
  for (std::size_t i = 0; i < motion.size(); ++i)
    if (!force_along(element, motion[i].row(0), sampling_hz, forces[i])) return false;
  along_it = stacked([&](std::size_t i) { return forces[i]; });
  return true;
}

void size_by_motion(const std::vector<Matrix>& motion, ElementOperation& operation) {
  double low = 0, high = 0, count = 0, sum = 0, square = 0, rate = 0;
  for (const Matrix& own : motion) {
    low = std::min(low, own.row(0).minCoeff());
    high = std::max(high, own.row(0).maxCoeff());
    sum += own.row(0).sum();
    square += own.row(0).squaredNorm();
    rate += own.row(1).squaredNorm();
    count += static_cast<double>(own.cols());
  }
  const double travel_rms = std::sqrt(std::max(square / count - sum * sum / (count * count), 0.0));
  const double share = operation.travel_rms_m > 0 ? travel_rms / operation.travel_rms_m : 1;
  operation = {
      low, high, travel_rms, std::sqrt(rate / count), share * operation.force_high_n, share * operation.force_rms_n};
}

ForceScreened screen_by_known_force(const Study& study, const Plant& base, const ForceThere& there,
                                    const Place& location, std::vector<EffectCandidate> candidates,
                                    ConstVectorRef elsewhere, const ForceScreenOptions& options) {
  ForceScreened out;
  const Element* const own = element_at(base, location);
  Vector known = Vector::Zero(there.force.size());
  if (there.force.size() == 0 || (own != nullptr && !there.along(*own, known))) return out;
  const Vector unknown = there.force - known;
  // What re-tuning the laws of the place does to their force.
  const OfPlace of_place = tolerances_at(study, location);
  Matrix retuning(unknown.size(), static_cast<Index>(of_place.parameters.size()));
  for (std::size_t k = 0; k < of_place.parameters.size(); ++k) {
    Plant moved = base;
    const FitParameter& parameter = of_place.parameters[k];
    set_parameter(moved, parameter.name, get_parameter(moved, parameter.name) + parameter.scale);
    Vector changed;
    if (!there.along(*element_at(moved, location), changed)) return out;
    retuning.col(static_cast<Index>(k)) = changed - known;
  }
  const Beyond beyond(std::move(retuning));
  const Vector force = beyond(unknown);
  const double power = force.squaredNorm();
  if (!(power > 0)) return out;

  std::vector<Screened> typical(candidates.size());
  tbb::parallel_for(std::size_t{0}, candidates.size(), [&](std::size_t c) {
    typical[c].candidate = c;
    typical[c].gain = share_made(candidates[c], there, known, location, beyond, force);
  });
  std::stable_sort(typical.begin(), typical.end(),
                   [](const Screened& a, const Screened& b) { return a.gain > b.gain; });
  typical.resize(std::min(typical.size(), options.fits));

  std::vector<Screened> fitted(typical.size());
  out.candidates.resize(typical.size());
  tbb::parallel_for(std::size_t{0}, typical.size(), [&](std::size_t k) {
    EffectCandidate& candidate = out.candidates[k] = candidates[typical[k].candidate];
    fitted[k].candidate = k;
    const ElementProblem problem(there, candidate, of_place.parameters, std::sqrt(unknown.squaredNorm()));
    const Solution solution =
        study.solvers.thorough.minimise(problem, Vector::Zero(problem.parameters()), {kIterations});
    Vector r(problem.residuals());
    if (solution.theta.size() == 0 || !problem.residual(solution.theta, r)) return;
    fitted[k].gain = 1 - r.head(unknown.size()).squaredNorm() * unknown.squaredNorm() / power;
    candidate.plant = problem.plant(solution.theta);
    candidate.proportional = false;  // its size is known
    fitted[k].strength = 1;
    // The study's tolerances count from the plant as delivered, whatever `base` holds.
    Vector theta = elsewhere;
    for (std::size_t i = 0; i < of_place.number.size(); ++i) {
      const FitParameter& own_parameter = of_place.parameters[i];
      theta(static_cast<Index>(of_place.number[i])) =
          (get_parameter(candidate.plant, own_parameter.name) - get_parameter(study.nominal, own_parameter.name)) /
          own_parameter.scale;
    }
    for (const FitParameter& tolerance : study.tolerances)
      set_parameter(candidate.plant, tolerance.name, get_parameter(study.nominal, tolerance.name));
    fitted[k].retuning = theta;
  });
  std::stable_sort(fitted.begin(), fitted.end(), [](const Screened& a, const Screened& b) { return a.gain > b.gain; });
  std::erase_if(fitted, [&](const Screened& one) { return !(one.gain > options.share); });
  fitted.resize(std::min(fitted.size(), options.fits_of_plant));
  out.screened = std::move(fitted);
  return out;
}

}  // namespace wheelhop
