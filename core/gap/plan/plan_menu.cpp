#include "core/gap/plan/plan_menu.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/base/random.hpp"
#include "core/data/metrics.hpp"
#include "core/data/spectra.hpp"
#include "core/gap/plan/responses.hpp"
#include "core/plant/butterworth.hpp"
#include "core/plant/dataset.hpp"
#include "core/plant/linearise.hpp"
#include "core/plant/rotary.hpp"

namespace wheelhop {
namespace {

constexpr double kBandShare = 0.99;        // of the power of the responses
constexpr double kUsableBand = 0.4;        // of the sampling rate: an interpolated drive is exact up to here
constexpr double kSlow = 0.2;              // of the slowest mode: quasi-static
constexpr Index kListed = 2;               // elements in the name of an item
constexpr double kSlowestTriangle = 0.05;  // Hz

/// Calls change(row, input, record) on every row of a copy of the drives that moves the plant. A schedule stays as it
/// was planned: its values are no level to be raised.
template <class Change>
std::vector<FitRecord> changed(const Plant& plant, std::vector<FitRecord> records, Change change) {
  for (std::size_t r = 0; r < records.size(); ++r)
    for (Index i = 0; i < records[r].drive.rows(); ++i) {
      if (!plant.inputs[static_cast<std::size_t>(i)].moves()) continue;
      Vector row = records[r].drive.row(i);
      change(row, i, r);
      records[r].drive.row(i) = row;
    }
  return records;
}

/// Frequency below which the responses, in noise units, have nearly all of their power; two digits.
double band_hz(const std::vector<FitRecord>& records, double hold_hz) {
  double edge_hz = 0;
  for (const FitRecord& record : records) {
    const Matrix y = record.weight_std.cwiseInverse().asDiagonal() * record.y;
    const Vector power = hann_spectrum(y).cwiseAbs2().colwise().sum();
    const double wanted = kBandShare * power.sum();
    double sum = 0;
    Index line = 0;
    while (line + 1 < power.size() && (sum += power(line)) < wanted) ++line;
    const double rate_hz = hold_hz / static_cast<double>(record.ratio);
    edge_hz = std::max(edge_hz, fft_frequencies_hz(record.y.cols(), 1 / rate_hz)(line));
  }
  return edge_hz;
}

/// Two significant digits, as an engineer would set it.
double rounded(double value) {
  const double unit = std::pow(10, std::floor(std::log10(value)) - 1);
  return std::round(value / unit) * unit;
}

double slowest_mode_hz(const Plant& plant) {
  for (const Mode& mode : modes(linearise(plant).A))
    if (mode.frequency_hz > 1e-6) return mode.frequency_hz;
  return 0;
}

void add_bands(const Plant& plant, const std::vector<FitRecord>& records, std::vector<MenuDrive>& menu) {
  const double hold_hz = plant.hold_hz(), edge_hz = band_hz(records, hold_hz);
  if (!(edge_hz > 0)) return;
  const double low_hz = rounded(edge_hz / 2);
  const auto low_pass = butterworth_lowpass(4, low_hz, hold_hz);
  menu.push_back({fmt::format("with the drive low-passed at {:g} Hz", low_hz),
                  changed(plant, records,
                          [&](Vector& u, Index, std::size_t) {
                            const double first = u(0);  // the filter starts from rest
                            u.array() -= first;
                            filter(low_pass, u);
                            u.array() += first;
                          }),
                  {}});
  const double sampling_hz = hold_hz / static_cast<double>(records.front().ratio);
  const double top_hz = rounded(std::min(4 * edge_hz, kUsableBand * sampling_hz));
  if (top_hz < 1.5 * edge_hz) return;
  const auto shape = butterworth_lowpass(8, top_hz, hold_hz);
  menu.push_back({fmt::format("with noise up to {:g} Hz", top_hz),
                  changed(plant, records,
                          [&](Vector& u, Index i, std::size_t r) {
                            Random random(1, Stream::road, r, static_cast<std::uint64_t>(i));
                            Vector noise = random.normal(u.size(), 1);
                            filter(shape, noise);
                            const auto rate = [](const Vector& x) {
                              return (x.tail(x.size() - 1) - x.head(x.size() - 1)).norm();
                            };
                            u += noise * (rate(u) / rate(noise));
                          }),
                  {}});
}

void add_triangle(const Plant& plant, const std::vector<FitRecord>& records, std::vector<MenuDrive>& menu) {
  FitRecord record = records.front();
  const double duration_s = static_cast<double>(record.drive.cols()) / plant.hold_hz();
  const double frequency_hz = std::max(kSlowestTriangle, 2 / duration_s);
  if (!(frequency_hz < kSlow * slowest_mode_hz(plant))) return;
  for (Index i = 0; i < record.drive.rows(); ++i) {
    if (!plant.inputs[static_cast<std::size_t>(i)].moves()) continue;
    const double mean = record.drive.row(i).mean();
    const double peak = (record.drive.row(i).array() - mean).abs().maxCoeff();
    // Inputs follow one another, so that they move against each other too.
    const double lag = 0.5 * static_cast<double>(i) / static_cast<double>(record.drive.rows());
    for (Index k = 0; k < record.drive.cols(); ++k) {
      const double phase = static_cast<double>(k) / plant.hold_hz() * frequency_hz + 0.25 - lag;
      record.drive(i, k) = mean + peak * (4 * std::abs(phase - std::round(phase)) - 1);
    }
  }
  menu.push_back({fmt::format("with a slow triangle of {:.2g} Hz and the peak amplitude", frequency_hz), {record}, {}});
}

/// Stiffness [N/m] at zero travel.
double stiffness(const Element& element) {
  double sum = 0, k = 0, d = 0;
  for (const Law& law : element.laws)
    if (law.states() == 0 && law.kind->role == LawRole::force && law.slopes(0, 0, k, d)) sum += k;
  return sum;
}

bool is_drive(const Plant& plant, const std::string& node) {
  return std::any_of(plant.inputs.begin(), plant.inputs.end(), [&](const PlantInput& input) {
    return input.kind == InputKind::displacement && input.name == node;
  });
}

void add_ride_height(const Plant& plant, const std::vector<FitRecord>& records, std::vector<MenuDrive>& menu) {
  Plant probe = plant;
  probe.sensors.clear();
  std::vector<const Element*> places;
  for (const Element& element : plant.elements) {
    if (is_drive(plant, element.from) || is_drive(plant, element.to) || !(stiffness(element) > 0)) continue;
    places.push_back(&element);
    probe.sensors.push_back({element.name, SensorKind::displacement, element.from, element.to, "m"});
  }
  if (places.empty()) return;
  std::vector<FitRecord> probed = records;
  for (FitRecord& record : probed) record.weight_std = Vector::Ones(probe.sensor_count());
  Vector ignored;
  std::vector<Vector> start;
  std::string message;
  if (nominal_outputs(probe, probed, ignored, start, message) != Status::ok) return;
  MenuDrive item{"", records, {}};
  Vector force(probe.sensor_count());
  for (Index e = 0; e < force.size(); ++e) {
    const Element& element = *places[static_cast<std::size_t>(e)];
    const double travel_m = rms(probed.front().y)(e);
    force(e) = stiffness(element) * travel_m;
    if (e < kListed) item.name += fmt::format("{}{:.2g} mm at {}", e ? ", " : "", 1e3 * travel_m, element.name);
    item.inputs.push_back({"static_force:" + element.name,
                           InputKind::force,
                           "N",
                           plant.hold_hz(),
                           "zoh",
                           element.from,
                           element.to,
                           {},
                           plant.held()});
  }
  if (force.size() > kListed) item.name += fmt::format(", and {} more", force.size() - kListed);
  item.name = "with the ride height shifted (" + item.name + ")";
  for (FitRecord& record : item.records) {
    const Index own = record.drive.rows();
    record.drive.conservativeResize(own + force.size(), Eigen::NoChange);
    record.drive.bottomRows(force.size()).colwise() = force;
  }
  menu.push_back(std::move(item));
}

}  // namespace

std::vector<MenuDrive> menu_drives(const Plant& plant, const std::vector<FitRecord>& records) {
  std::vector<MenuDrive> menu;
  for (const double factor : {0.5, 1.5, 2.0})
    menu.push_back({fmt::format("at {:g} x the level", factor),
                    changed(plant, records,
                            [&](Vector& u, Index, std::size_t) {
                              const double mean = u.mean();
                              u = (mean + factor * (u.array() - mean)).matrix().eval();
                            }),
                    {}});
  add_bands(plant, records, menu);
  add_triangle(plant, records, menu);
  add_ride_height(plant, records, menu);
  return menu;
}

std::vector<MenuSensor> menu_sensors(const Plant& plant) {
  std::vector<MenuSensor> list;
  const auto offer = [&](SensorKind kind, const std::string& from, const std::string& to, const std::string& what) {
    const bool known = std::any_of(plant.sensors.begin(), plant.sensors.end(), [&](const Sensor& sensor) {
      return sensor.kind == kind &&
             ((sensor.from == from && sensor.to == to) || (sensor.from == to && sensor.to == from));
    });
    if (!known)
      list.push_back({"with a sensor: " + what,
                      {"menu:" + what, kind, from, to,
                       std::string(is_rotary(plant, to) || is_rotary(plant, from) ? "rad" : "m") +
                           (kind == SensorKind::acceleration ? "/s^2" : "")}});
  };
  for (const Mass& mass : plant.masses)
    offer(SensorKind::acceleration, "ground", mass.name, "acceleration of " + mass.name);
  for (const Element& element : plant.elements)
    offer(SensorKind::displacement, element.from, element.to, "travel of " + element.name);
  for (const PlantInput& input : plant.inputs)
    if (input.kind == InputKind::displacement)
      offer(SensorKind::displacement, "ground", input.name, "position of " + input.name);
  return list;
}

}  // namespace wheelhop
