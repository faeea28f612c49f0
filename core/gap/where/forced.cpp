#include "core/gap/where/forced.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/data/resample.hpp"
#include "core/gap/where/locate.hpp"
#include "core/gap/where/probe.hpp"
#include "core/greybox/trajectory.hpp"

namespace wheelhop {

ForcedPlant force_at(const PlantFit& fit, const std::vector<FitRecord>& records, const Place& location,
                     const std::vector<Vector>& forces) {
  ForcedPlant forced;
  ForcePlace place;
  force_place_of(fit.plant, location, place);
  forced.fit.plant = plant_with_force(fit.plant, place);
  forced.fit.plant.elements.push_back(
      {location.name + " motion", place.from, place.to, {{find_law("linear_spring"), {0}}}});
  forced.fit.initial_states = fit.initial_states;
  for (std::size_t i = 0; i < records.size(); ++i) {
    FitRecord record = records[i];
    // A law of positive force pulls its second node near, a force input pushes it away. Held, it has to be the mean
    // over each interval, or it comes half of one late.
    Matrix force = interpolate(-forces[i].transpose(), record.ratio, Interpolation::band_limited);
    const Index last = force.cols() - 1;
    force.leftCols(last) = 0.5 * (force.leftCols(last) + force.rightCols(last)).eval();
    // The drive of a record may go on behind its last compared sample; the force there is not known.
    record.drive = Matrix::Zero(records[i].drive.rows() + 1, records[i].drive.cols());
    record.drive.topRows(records[i].drive.rows()) = records[i].drive;
    const Index known = std::min(force.cols(), record.drive.cols());
    record.drive.bottomRows(1).leftCols(known) = force.leftCols(known);
    forced.records.push_back(std::move(record));
  }
  return forced;
}

std::vector<Matrix> residuals(const ForcedPlant& forced) {
  Vector all;
  std::vector<Matrix> list;
  if (!plant_residual(forced.fit.plant, forced.records, forced.fit.initial_states, all)) return list;
  Index first = 0;
  for (const FitRecord& record : forced.records) {
    const Index p = record.y.rows(), kept = record.y.cols() - record.skip;
    list.push_back(all.segment(first, p * kept).reshaped(p, kept));
    first += p * kept;
  }
  return list;
}

std::vector<Matrix> motion_at_place(const ForcedPlant& forced) {
  std::vector<Matrix> list;
  for (const Trajectory& trajectory : trajectories(forced.fit, forced.records)) {
    Matrix motion(2, trajectory.travel.cols());
    motion << trajectory.travel.bottomRows(1), trajectory.rate.bottomRows(1);
    list.push_back(std::move(motion));
  }
  return list;
}

Matrix faded(const Matrix& residual) { return residual * fade_window(residual.cols()).asDiagonal(); }

double inner_misfit(const std::vector<Matrix>& residuals) {
  double sum = 0, count = 0;
  for (const Matrix& r : residuals) {
    const Index fade = fade_samples(r.cols());
    const Matrix inner = r.middleCols(fade, r.cols() - 2 * fade);
    sum += inner.squaredNorm();
    count += static_cast<double>(inner.size());
  }
  return count > 0 ? sum / count : std::numeric_limits<double>::quiet_NaN();
}

ForceReconstruction reconstruct_force(const PlantFit& fit, const std::vector<FitRecord>& records,
                                      const Place& location) {
  ForceReconstruction best;
  PlantFit rest = fit;
  double misfit = std::numeric_limits<double>::infinity();
  for (int step = 0; step < kReconstructions; ++step) {
    std::vector<Vector> forces;
    for (std::size_t i = 0; i < records.size(); ++i) {
      const UnknownSignal signal = unknown_signal(rest, records, i, location);
      if (step == 0 && signal.status != Status::ok) best.why_not = signal.message;
      if (signal.status != Status::ok) return best;
      forces.push_back(step == 0 ? signal.value : best.forces[i] + signal.value);
    }
    ForcedPlant forced = force_at(fit, records, location, forces);
    std::vector<Matrix> left = residuals(forced);
    const double own = inner_misfit(left);
    if (step == 0 && !std::isfinite(own)) best.why_not = "the plant cannot follow an unknown force";
    if (!(own < kWorthwhile * misfit)) return best;
    misfit = own;
    for (std::size_t i = 0; i < records.size(); ++i)
      rest.error[i].rightCols(left[i].cols()) = records[i].weight_std.asDiagonal() * left[i];
    best = {"", std::move(forces), std::move(forced), std::move(left)};
  }
  return best;
}

}  // namespace wheelhop
