#include "core/gap/locate.hpp"

#include <algorithm>
#include <cmath>

#include "core/data/spectra.hpp"
#include "core/identify/direction.hpp"
#include "core/plant/linearise.hpp"

namespace wheelhop {
namespace {

constexpr double kSameDirection = 0.9999;
// What a nonlinear effect makes of a drive reaches beyond it, to its second harmonic and a little more.
constexpr double kBandOverDrive = 2.2;
constexpr double kDrivePower = 0.999;

/// A force of one Newton at a place, through the plant linearised at rest and held over a sample of the record.
struct Probe {
  Place place;
  Matrix A, C, Bt, Dt;
};

bool is_displacement_input(const Plant& plant, const std::string& node) {
  for (const PlantInput& input : plant.inputs)
    if (input.kind == InputKind::displacement && input.name == node) return true;
  return false;
}

/// @param from, to as of a force input; a drive's node stands still for a force
bool make_probe(const Plant& plant, std::string from, std::string to, double sample_time_s, const std::string& location,
                Probe& probe) {
  if (is_displacement_input(plant, from)) from = "ground";
  if (is_displacement_input(plant, to)) to = "ground";
  if (from == to) return false;
  Plant probed = plant;
  PlantInput force;
  force.name = "probe of " + location;
  force.kind = InputKind::force;
  force.unit = "N";
  force.hold_hz = plant.hold_hz();
  force.from = from;
  force.to = to;
  probed.inputs.push_back(force);
  const LinearPlant linear = linearise(probed);
  if (linear.A.size() == 0) return false;
  const Index last = linear.B.cols() - 1;
  const DiscreteInput discrete = discretise_zoh(linear.A, linear.B.col(last), sample_time_s);
  probe = {{location, {}, 0}, discrete.A, linear.C, discrete.B, linear.D.col(last)};
  return true;
}

/// [C A^k Bt; Dt] tells a direction in the outputs without depending on the coordinates of the state.
Vector response_of(const Probe& probe) {
  Vector response(probe.C.rows() * 12);
  response.head(probe.C.rows()) = probe.Dt;
  Vector x = probe.Bt;
  for (Index k = 1; k < 12; ++k) {
    response.segment(k * probe.C.rows(), probe.C.rows()) = probe.C * x;
    x = probe.A * x;
  }
  return response.normalized();
}

std::vector<Probe> probes_of(const Plant& plant, double sample_time_s) {
  std::vector<Probe> probes;
  const auto add = [&](const std::string& from, const std::string& to, const std::string& location) {
    Probe probe;
    if (!make_probe(plant, from, to, sample_time_s, location, probe)) return;
    const Vector own = response_of(probe);
    for (Probe& other : probes)
      if (std::abs(own.dot(response_of(other))) > kSameDirection) {
        other.place.same.push_back(location);
        return;
      }
    probes.push_back(std::move(probe));
  };
  for (const Element& element : plant.elements) {
    add(element.from, element.to, element.name);
    if (!probes.empty() && probes.back().place.location == element.name &&
        (is_displacement_input(plant, element.from) || is_displacement_input(plant, element.to)))
      probes.back().place.same.push_back("actuator");
  }
  for (const Mass& mass : plant.masses) add("ground", mass.name, "guide:" + mass.name);
  return probes;
}

/// Residual of a record in units of its noise, as measured minus simulated.
Matrix residual_of(const PlantFit& fit, const std::vector<FitRecord>& records, std::size_t i) {
  return records[i].weight_std.cwiseInverse().asDiagonal() * -fit.error[i];
}

/// Upper end of the band [Hz] that holds nearly all of the drives' power, widened.
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

}  // namespace

std::vector<Place> locate(const PlantFit& fit, const std::vector<FitRecord>& records) {
  std::vector<Place> places;
  const Index p = fit.plant.sensor_count();
  if (p < 2 || fit.error.size() != records.size()) return places;
  const double sample_time_s = static_cast<double>(records.front().ratio) / fit.plant.hold_hz();
  std::vector<Probe> probes = probes_of(fit.plant, sample_time_s);
  Vector left = Vector::Zero(static_cast<Index>(probes.size())), power = Vector::Zero(p);
  double noise = 0;  // what white noise of the floor's size leaves of one channel's freedom
  for (std::size_t i = 0; i < records.size(); ++i) {
    const Matrix z = residual_of(fit, records, i).rightCols(fit.error[i].cols() - records[i].skip);
    DirectionOptions options;
    options.cutoff_hz = std::min(excited_band_hz(fit.plant, records[i]), 0.4 / sample_time_s);
    const ComplexMatrix spectrum = hann_spectrum(z);
    const double bin_hz = 1 / (sample_time_s * static_cast<double>(z.cols()));
    const Index bins = std::min<Index>(spectrum.cols(), static_cast<Index>(options.cutoff_hz / bin_hz) + 1);
    const Vector own = spectrum.leftCols(bins).rowwise().squaredNorm();
    power += own;
    noise += 6.0 * static_cast<double>(bins) / static_cast<double>(z.cols());
    const Matrix weight = records[i].weight_std.cwiseInverse().asDiagonal();
    for (std::size_t k = 0; k < probes.size(); ++k) {
      const auto problem = direction_problem(probes[k].A, weight * probes[k].C, z, sample_time_s, options);
      Vector direction(probes[k].Bt.size() + p), r(problem->residuals());
      direction << probes[k].Bt, weight * probes[k].Dt;
      double& sum = left(static_cast<Index>(k));
      sum += problem->residual(direction.normalized(), r) ? r.squaredNorm() * own.sum() : own.sum();
    }
  }
  const double freedom = static_cast<double>(p - 1) * noise;
  for (Index j = 0; j < p; ++j)
    places.push_back(
        {"sensor:" + fit.plant.sensors[static_cast<std::size_t>(j)].name, {}, (power.sum() - power(j)) / freedom});
  for (std::size_t k = 0; k < probes.size(); ++k) {
    probes[k].place.leftover = left(static_cast<Index>(k)) / freedom;
    places.push_back(std::move(probes[k].place));
  }
  std::stable_sort(places.begin(), places.end(),
                   [](const Place& a, const Place& b) { return a.leftover < b.leftover; });
  return places;
}

}  // namespace wheelhop
