#include "core/gap/where/probe.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/data/spectra.hpp"
#include "core/plant/rotary.hpp"

namespace wheelhop {
namespace {

// What a nonlinear effect makes of a drive reaches beyond it, to its second harmonic and a little more.
constexpr double kBandOverDrive = 2.2;
constexpr double kDrivePower = 0.999;
constexpr Index kFadePart = 20;

bool is_displacement_input(const Plant& plant, const std::string& node) {
  for (const PlantInput& input : plant.inputs)
    if (input.kind == InputKind::displacement && input.name == node) return true;
  return false;
}

}  // namespace

bool drives(const PlantInput& input, const Element& element) {
  return input.kind == InputKind::displacement && (input.name == element.from || input.name == element.to);
}

bool force_place_of(const Plant& plant, const Place& location, ForcePlace& place) {
  for (const Element& element : plant.elements) {
    const bool driven = std::any_of(plant.inputs.begin(), plant.inputs.end(), [&](const PlantInput& input) {
      return drives(input, element) && actuator_of(plant, input) == location;
    });
    if (location_of(element) != location && !driven) continue;
    place = {element.from, element.to, element.name};
    return true;
  }
  for (const Mass& mass : plant.masses)
    if (location == guide_place(mass.name)) {
      place = {"ground", mass.name};
      return true;
    }
  return false;
}

Plant plant_with_force(const Plant& plant, ForcePlace place) {
  Plant probed = plant;
  for (std::string* end : {&place.from, &place.to})
    if (is_displacement_input(plant, *end)) *end = "ground";
  const bool read =
      !place.element.empty() && std::any_of(plant.sensors.begin(), plant.sensors.end(),
                                            [&](const Sensor& sensor) { return sensor.element == place.element; });
  if (place.from == place.to && !read) return probed;
  PlantInput force;
  force.name = "probe between " + place.from + " and " + place.to;
  force.kind = InputKind::force;
  force.unit = is_rotary(plant, place.to) || is_rotary(plant, place.from) ? "N m" : "N";
  force.hold_hz = plant.hold_hz();
  force.held = plant.held();
  force.from = place.from;
  force.to = place.to;
  force.inside = place.element;
  probed.inputs.push_back(force);
  return probed;
}

LinearPlant linearise_with_force(const PlantFit& fit, const ForcePlace& place) {
  const Plant probed = plant_with_force(fit.plant, place);
  if (probed.inputs.size() == fit.plant.inputs.size()) return {};
  if (fit.visited.size() == 0) return linearise(probed);
  const Index m = fit.plant.input_count(), states = fit.visited.rows() - m, K = fit.visited.cols();
  Matrix inputs = Matrix::Zero(m + 1, K);
  inputs.topRows(m) = fit.visited.bottomRows(m);
  return linearise_along(probed, fit.visited.topRows(states), inputs);
}

ComplexVector force_response(const LinearPlant& linear, double frequency_hz) {
  const Index last = linear.B.cols() - 1;
  ComplexMatrix pencil = -linear.A.cast<std::complex<double>>();
  pencil.diagonal().array() += std::complex<double>(0, 2 * std::numbers::pi * frequency_hz);
  const ComplexMatrix b = linear.B.col(last).cast<std::complex<double>>();
  return linear.C * solve_complex(pencil, b) + linear.D.col(last);
}

Matrix residual_of(const PlantFit& fit, const std::vector<FitRecord>& records, std::size_t i) {
  return records[i].weight_std.cwiseInverse().asDiagonal() * -fit.error[i];
}

double excited_band_hz(const Plant& plant, const FitRecord& record) {
  const ComplexMatrix spectrum = hann_spectrum(record.drive);
  const double bin_hz = plant.hold_hz() / static_cast<double>(record.drive.cols());
  double widest = 0;
  for (Index i = 0; i < spectrum.rows(); ++i) {
    const double total = spectrum.row(i).squaredNorm();
    double sum = 0;
    Index k = 0;
    while (k < spectrum.cols() && sum < kDrivePower * total) sum += std::norm(spectrum(i, k++));
    widest = std::max(widest, static_cast<double>(k) * bin_hz);
  }
  return kBandOverDrive * widest;
}

Index fade_samples(Index samples) { return samples / kFadePart; }

Vector fade_window(Index samples) {
  const Index fade = fade_samples(samples);
  Vector window = Vector::Ones(samples);
  for (Index k = 0; k < fade; ++k) {
    const double phase = std::numbers::pi * (static_cast<double>(k) + 0.5) / static_cast<double>(fade);
    window(k) = window(samples - 1 - k) = 0.5 * (1 - std::cos(phase));
  }
  return window;
}

}  // namespace wheelhop
