#include "core/gap/which/force_screen.hpp"

#include <tbb/parallel_for.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "core/data/slow_channels.hpp"
#include "core/gap/where/forced.hpp"
#include "core/gap/where/probe.hpp"
#include "core/greybox/operation.hpp"
#include "core/greybox/trajectory.hpp"

namespace wheelhop {
namespace {

constexpr Index kSteps = 4, kMostSteps = 64;  // of a simulation between two samples
constexpr double kNothing = 1e-9;             // of a column, which is round-off
constexpr Index kSamples = 20000;             // of the records that are asked: a judgement, a bound on the time
constexpr Index kIterations = 20;             // of a fit of one element
// Judgements: lengths of the pieces in which a plant is fitted, one after the other, in shares of a block. A solution
// in short pieces is where the fit in longer ones begins.
constexpr Index kPieces[] = {1, 4, 16}, kPiecesOfBlock = 4;
constexpr Index kRounds = 2;  // a judgement: a fit in pieces may take so many times a study's iterations

/// The element at a location; null if there is none yet.
const Element* element_at(const Plant& plant, const Place& location) {
  for (const Element& element : plant.elements)
    if (location_of(element) == location) return &element;
  return nullptr;
}

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

/// The ranges of an element's travel and rate under the unknown force, its forces in proportion.
void sized_by(const std::vector<Matrix>& motion, ElementOperation& operation) {
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

/// What is known of the force at a place: the motion there and, of the samples in which nothing fades, the element's
/// whole force.
struct ForceThere {
  std::vector<Matrix> motion;                    // 2 x N a record
  std::vector<std::pair<Index, Index>> samples;  // first and number of those, a record
  double sampling_hz = 0;
  Vector force;

  /// Values at these samples of all records, about their mean.
  template <class OfRecord>
  Vector stacked(const OfRecord& of_record) const {
    Index rows = 0;
    for (const auto& [first, count] : samples) rows += count;
    Vector all(rows);
    Index filled = 0;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      all.segment(filled, samples[i].second) = of_record(i).segment(samples[i].first, samples[i].second);
      filled += samples[i].second;
    }
    return all.array() - all.mean();
  }
  /// Force of an element along the motion. False outside its domain.
  bool along(const Element& element, Vector& along_it) const {
    std::vector<Vector> forces(motion.size());
    for (std::size_t i = 0; i < motion.size(); ++i)
      if (!force_along(element, motion[i].row(0), sampling_hz, forces[i])) return false;
    along_it = stacked([&](std::size_t i) { return forces[i]; });
    return true;
  }
};

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

/// Records in pieces, and where the motion begins in each.
struct Pieces {
  std::vector<FitRecord> records;
  std::vector<std::size_t> of;  ///< number of the record that each is a piece of
  std::vector<Index> begin;     ///< its first sample there
  PlantFit states;
};

/// @param state_at of record i at sample k, 2n
template <class StateAt>
Pieces pieces_of(const std::vector<FitRecord>& records, const PlantFit& base, Index samples, const StateAt& state_at) {
  Pieces out;
  out.states.state_scale = base.state_scale;
  const Index states = base.state_scale.size();
  for (std::size_t i = 0; i < records.size(); ++i) {
    const FitRecord& whole = records[i];
    const Index count = std::max<Index>((whole.y.cols() - whole.skip) / samples, 1);
    for (Index k = 0; k < count; ++k) {
      const Index begin = whole.skip + k * samples, end = k + 1 < count ? begin + samples : whole.y.cols();
      FitRecord piece = whole;
      piece.drive = whole.drive.middleCols(begin * whole.ratio, (end - begin) * whole.ratio);
      piece.y = whole.y.middleCols(begin, end - begin);
      piece.skip = 0;
      if (begin > 0) piece.start = {};
      piece.slow = part_of(whole.slow, begin, end - begin);
      out.records.push_back(std::move(piece));
      out.of.push_back(i);
      out.begin.push_back(begin);
      out.states.initial_states.push_back(state_at(i, begin));
    }
  }
  out.states.states_at_rest.resize(states * static_cast<Index>(out.of.size()));
  for (std::size_t k = 0; k < out.of.size(); ++k)
    out.states.states_at_rest.segment(states * static_cast<Index>(k), states) =
        base.states_at_rest.segment(states * static_cast<Index>(out.of[k]), states);
  return out;
}

/// The whole plant with a candidate fitted to the records in pieces of growing length, each of which begins where the
/// solution of the shorter ones says. @param theta in: where to begin; out: the solution of the longest
/// @return initial states of the records
std::vector<InitialState> fit_in_pieces(const Study& study, const EffectCandidate& candidate,
                                        const std::vector<FitParameter>& parameters, const PlantFit& base,
                                        const std::vector<FitRecord>& records, const std::vector<Trajectory>& motion,
                                        Vector& theta) {
  const Index n = base.plant.mass_count();
  Pieces pieces;
  for (const Index length : kPieces) {
    const Index samples = std::max<Index>(length * study.data.block / kPiecesOfBlock, 1);
    pieces = pieces_of(records, base, samples, [&](std::size_t i, Index sample) {
      for (std::size_t k = 0; k < pieces.of.size(); ++k)
        if (pieces.of[k] == i && pieces.begin[k] == sample) return pieces.states.initial_states[k];
      Vector state(2 * n);
      state << motion[i].position.col(sample), motion[i].velocity.col(sample);
      return InitialState(std::move(state));
    });
    const PlantFit fit = fit_plant(
        candidate.plant, parameters, pieces.records, study.solvers.thorough,
        {.iterations = kRounds * study.iterations, .from = &pieces.states, .linearise = false, .theta = theta});
    if (fit.error.empty()) break;
    theta = fit.theta;
    pieces.states.initial_states = fit.initial_states;
  }
  std::vector<InitialState> first(records.size());
  for (std::size_t k = 0; k < pieces.of.size(); ++k)
    if (first[pieces.of[k]].motion.size() == 0) first[pieces.of[k]] = pieces.states.initial_states[k];
  return first;
}

}  // namespace

ForceScreened screen_by_force(const Study& study, const PlantFit& home, const PlantFit& retuned, const Place& location,
                              const ForceScreenOptions& options) {
  ForceScreened out;
  ForcePlace place;
  Operation operation;
  // The first records tell a law as well as many do.
  std::vector<FitRecord> records;
  PlantFit base = home;
  base.error.clear();
  base.initial_states.clear();
  Index length = 0;
  for (std::size_t i = 0; i < study.data.fitted.size() && (i == 0 || length < kSamples); ++i) {
    records.push_back(study.data.fitted[i]);
    base.error.push_back(home.error[i]);
    base.initial_states.push_back(home.initial_states[i]);
    length += records.back().y.cols();
  }
  if (!force_place_of(base.plant, location, place) ||
      !operation_of(base.plant, records, base.initial_states, operation))
    return out;
  const ForceReconstruction asked = reconstruct_force(base, records, location);
  if (!asked.why_not.empty() || asked.forces.empty()) return out;
  ForceThere known_force;
  known_force.motion = motion_at_place(asked.forced);
  known_force.sampling_hz = base.plant.hold_hz() / static_cast<double>(records.front().ratio);
  for (std::size_t i = 0; i < records.size(); ++i) {
    const Matrix& motion = known_force.motion[i];
    if (motion.cols() == 0 || !all_finite(motion)) return out;
    const Index skip = records[i].skip, size = std::min(asked.forces[i].size(), motion.cols());
    const Index fade = fade_samples(size - skip);
    known_force.samples.emplace_back(skip + fade, std::max<Index>(size - skip - 2 * fade, 0));
  }
  for (std::size_t e = 0; e < base.plant.elements.size(); ++e)
    if (location_of(base.plant.elements[e]) == location) sized_by(known_force.motion, operation.elements[e]);
  for (std::size_t i = 0; i < base.plant.masses.size(); ++i)
    if (location == guide_place(base.plant.masses[i].name)) sized_by(known_force.motion, operation.guides[i]);
  std::vector<EffectCandidate> candidates = study.candidates(base.plant, operation);
  std::erase_if(candidates, [&](const EffectCandidate& candidate) {
    return candidate.location != location || !candidate.refines.empty() || candidate.parameters.empty() ||
           element_at(candidate.plant, location) == nullptr;
  });

  const Vector unknown = known_force.stacked([&](std::size_t i) { return asked.forces[i]; });
  const Element* const own = element_at(base.plant, location);
  Vector known = Vector::Zero(unknown.size());
  if (unknown.size() == 0 || (own != nullptr && !known_force.along(*own, known))) return out;
  known_force.force = known + unknown;
  // What re-tuning the laws of the place does to their force.
  const OfPlace of_place = tolerances_at(study, location);
  Matrix retuning(unknown.size(), static_cast<Index>(of_place.parameters.size()));
  for (std::size_t k = 0; k < of_place.parameters.size(); ++k) {
    Plant moved = base.plant;
    const FitParameter& parameter = of_place.parameters[k];
    set_parameter(moved, parameter.name, get_parameter(moved, parameter.name) + parameter.scale);
    Vector there;
    if (!known_force.along(*element_at(moved, location), there)) return out;
    retuning.col(static_cast<Index>(k)) = there - known;
  }
  const Beyond beyond(std::move(retuning));
  const Vector force = beyond(unknown);
  const double power = force.squaredNorm();
  if (!(power > 0)) return out;

  // By the typical size of each candidate.
  std::vector<Screened> typical(candidates.size());
  tbb::parallel_for(std::size_t{0}, candidates.size(), [&](std::size_t c) {
    typical[c].candidate = c;
    Vector there;
    if (!known_force.along(*element_at(candidates[c].plant, location), there)) return;
    const Vector column = beyond(there - known);
    const double size = column.squaredNorm(), common = column.dot(force);
    if (size > kNothing * (there - known).squaredNorm() && (common > 0 || candidates[c].either_sign))
      typical[c].gain = common * common / (size * power);
  });
  std::stable_sort(typical.begin(), typical.end(),
                   [](const Screened& a, const Screened& b) { return a.gain > b.gain; });
  typical.resize(std::min(typical.size(), options.fits));

  // With sizes fitted to the force, then to the records in pieces: in free run over a whole record a nonlinear plant
  // soon goes its own way, and no fit leads back.
  const std::vector<Trajectory> states = trajectories(asked.forced.fit, asked.forced.records);
  for (std::size_t i = 0; i < records.size(); ++i)
    if (states[i].position.cols() < records[i].y.cols()) return out;
  std::vector<Screened> fitted(typical.size());
  out.candidates.resize(typical.size());
  tbb::parallel_for(std::size_t{0}, typical.size(), [&](std::size_t k) {
    EffectCandidate& candidate = out.candidates[k] = candidates[typical[k].candidate];
    fitted[k].candidate = k;
    const ElementProblem problem(known_force, candidate, of_place.parameters, std::sqrt(unknown.squaredNorm()));
    const Solution solution =
        study.solvers.thorough.minimise(problem, Vector::Zero(problem.parameters()), {kIterations});
    Vector r(problem.residuals());
    if (solution.theta.size() == 0 || !problem.residual(solution.theta, r)) return;
    fitted[k].gain = 1 - r.head(unknown.size()).squaredNorm() * unknown.squaredNorm() / power;
    candidate.plant = problem.plant(solution.theta);
    candidate.proportional = false;  // its size is known
    fitted[k].strength = 1;
    Vector theta = Vector::Zero(retuned.theta.size());
    for (std::size_t i = 0; i < of_place.number.size(); ++i)
      theta(static_cast<Index>(of_place.number[i])) = solution.theta(static_cast<Index>(i));
    fitted[k].retuning = theta;
  });
  std::erase_if(fitted, [&](const Screened& one) { return !(one.gain > options.share); });
  std::stable_sort(fitted.begin(), fitted.end(), [](const Screened& a, const Screened& b) { return a.gain > b.gain; });
  fitted.resize(std::min(fitted.size(), options.fits_of_plant));
  tbb::parallel_for(std::size_t{0}, fitted.size(), [&](std::size_t k) {
    EffectCandidate& candidate = out.candidates[fitted[k].candidate];
    const auto count = static_cast<Index>(study.tolerances.size());
    for (const FitParameter& tolerance : study.tolerances)
      set_parameter(candidate.plant, tolerance.name, get_parameter(study.nominal, tolerance.name));
    std::vector<FitParameter> parameters = study.tolerances;
    parameters.insert(parameters.end(), candidate.parameters.begin(), candidate.parameters.end());
    Vector theta = Vector::Zero(static_cast<Index>(parameters.size()));
    theta.head(count) = fitted[k].retuning.head(count);
    fitted[k].initial_states = fit_in_pieces(study, candidate, parameters, base, records, states, theta);
    for (std::size_t i = 0; i < candidate.parameters.size(); ++i) {
      const FitParameter& own_parameter = candidate.parameters[i];
      set_parameter(candidate.plant, own_parameter.name,
                    get_parameter(candidate.plant, own_parameter.name) +
                        theta(count + static_cast<Index>(i)) * own_parameter.scale);
    }
    fitted[k].retuning.head(count) = theta.head(count);
    fitted[k].retuning -= retuned.theta;
  });
  out.screened = std::move(fitted);
  return out;
}

}  // namespace wheelhop
