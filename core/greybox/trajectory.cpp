#include "core/greybox/trajectory.hpp"

#include "core/data/resample.hpp"
#include "core/plant/dataset.hpp"
#include "core/plant/simulate.hpp"

namespace wheelhop {
namespace {

/// Travel of every element = from_masses q + from_drives u; the rates likewise.
struct TravelMap {
  Matrix from_masses, from_drives;
};

TravelMap travel_map(const Plant& plant) {
  const Motion motion(plant);
  const auto elements = static_cast<Index>(plant.elements.size());
  TravelMap map{Matrix::Zero(elements, plant.mass_count()), Matrix::Zero(elements, plant.input_count())};
  const auto add = [&](Index element, const std::string& name, double sign) {
    const Index node = plant.node(name);
    for (const Motion::Weight& weight : motion.weights(node))
      map.from_masses(element, weight.mass) += sign * weight.value;
    for (Index i = 0; i < plant.input_count(); ++i)
      if (motion.input_node(i) == node) map.from_drives(element, i) += sign;
  };
  for (Index e = 0; e < elements; ++e) {
    add(e, plant.elements[static_cast<std::size_t>(e)].to, 1);
    add(e, plant.elements[static_cast<std::size_t>(e)].from, -1);
  }
  return map;
}

}  // namespace

Matrix Trajectory::stacked() const {
  Matrix both(travel.rows() + rate.rows(), travel.cols());
  both << travel, rate;
  return both;
}

std::vector<std::string> trajectory_variables(const Plant& plant) {
  std::vector<std::string> names;
  for (const char* what : {".travel", ".velocity"})
    for (const Element& element : plant.elements) names.push_back(element.name + what);
  return names;
}

std::vector<Trajectory> trajectories(const PlantFit& fit, const std::vector<FitRecord>& records) {
  const TravelMap map = travel_map(fit.plant);
  const Index n = fit.plant.mass_count();
  std::vector<Trajectory> list;
  for (std::size_t i = 0; i < records.size(); ++i) {
    const FitRecord& record = records[i];
    const Simulation run =
        simulate_measured(fit.plant, record.drive, run_options(fit.plant, record, fit.initial_states[i]));
    const Matrix felt = apply_drive_paths(fit.plant, record.drive, 0);
    Matrix felt_rate = Matrix::Zero(felt.rows(), felt.cols());
    felt_rate.rightCols(felt.cols() - 1) =
        (felt.rightCols(felt.cols() - 1) - felt.leftCols(felt.cols() - 1)) * fit.plant.hold_hz();
    const Index kept = std::min(run.states.cols(), record.y.cols());
    Trajectory motion;
    motion.position = run.states.topRows(n).leftCols(kept);
    motion.velocity = run.states.middleRows(n, n).leftCols(kept);
    motion.travel = map.from_masses * motion.position + map.from_drives * decimate(felt, record.ratio).leftCols(kept);
    motion.rate =
        map.from_masses * motion.velocity + map.from_drives * decimate(felt_rate, record.ratio).leftCols(kept);
    list.push_back(std::move(motion));
  }
  return list;
}

}  // namespace wheelhop
