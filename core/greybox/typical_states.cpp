#include "core/greybox/typical_states.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <limits>

#include "core/data/metrics.hpp"
#include "core/greybox/plant_problem.hpp"
#include "core/plant/dataset.hpp"

namespace wheelhop {
namespace {

constexpr Index kBeginning = 4;         // samples a state, of a record whose initial state is found: a judgement
constexpr Index kStartIterations = 12;  // of its fit, likewise
constexpr double kAsForetold = 1.1;     // of what a linear estimate leaves, from which it is no estimate, likewise

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

}  // namespace

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

}  // namespace wheelhop
