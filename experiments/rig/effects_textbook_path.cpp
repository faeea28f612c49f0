// Effects of drives and sensors in the formulas of textbooks, most of them the catalogue's own.
#include <algorithm>
#include <cmath>

#include "experiments/rig/effects.hpp"

namespace wheelhop::blind {
namespace {

/// T s' = u - s on samples joined by straight lines, exact for them; starts settled.
void first_order(Eigen::Ref<Vector> u, double rate_hz, double time_s) {
  const double h = 1 / rate_hz, keep = std::exp(-h / time_s);
  double s = u.size() > 0 ? u(0) : 0, before = s;
  for (double& value : u) {
    const double now = value, slope = (now - before) / h;
    s = keep * (s - before + slope * time_s) + now - slope * time_s;
    before = now;
    value = s;
  }
}

std::optional<Formed> slow_drive(const Surroundings& rig, const std::string& place, Random&) {
  const Index i = input_at(*rig.plan, place);
  return Formed{1e-3 / rig.band_hz, 0.3 / rig.band_hz, [=](double size) {
                  const auto change = [=](Vector& u, double rate) { first_order(u, rate, size); };
                  return TrueEffect{.strength = size, .unit = "s", .drive = {{.input = i, .change = change}}};
                }};
}

std::optional<Formed> clipped_drive(const Surroundings& rig, const std::string& place, Random&) {
  const Index i = input_at(*rig.plan, place);
  const double peak = rig.input_peak(i);
  if (!(peak > 0)) return std::nullopt;
  return Formed{1.02, 4, [=, unit = rig.plan->inputs[static_cast<std::size_t>(i)].unit](double size) {
                  const double limit = peak / size;
                  const auto change = [=](Vector& u, double) { u = u.cwiseMax(-limit).cwiseMin(limit); };
                  return TrueEffect{.strength = limit, .unit = unit, .drive = {{.input = i, .change = change}}};
                }};
}

std::optional<Formed> slew_limited_drive(const Surroundings& rig, const std::string& place, Random&) {
  const Index i = input_at(*rig.plan, place);
  const double speed = rig.input_speed_rms(i);
  if (!(speed > 0)) return std::nullopt;
  return Formed{0.2, 2.5, [=, unit = rig.plan->inputs[static_cast<std::size_t>(i)].unit](double size) {
                  const double limit = speed / size;
                  const auto change = [=](Vector& u, double rate) {
                    for (Index k = 1; k < u.size(); ++k)
                      u(k) = u(k - 1) + std::clamp(u(k) - u(k - 1), -limit / rate, limit / rate);
                  };
                  return TrueEffect{.strength = limit, .unit = unit + "/s", .drive = {{.input = i, .change = change}}};
                }};
}

std::optional<Formed> slow_sensor(const Surroundings& rig, const std::string& place, Random&) {
  const Index i = sensor_at(*rig.plan, place);
  return Formed{1e-4 / rig.band_hz, 0.3 / rig.band_hz, [=](double size) {
                  const auto step = [=](Matrix& y, Index, double rate) {
                    Vector reading = y.row(i).transpose();
                    first_order(reading, rate, size);
                    y.row(i) = reading.transpose();
                  };
                  return TrueEffect{.strength = size, .unit = "s", .sensors = {step}};
                }};
}

std::optional<Formed> ramp(const Surroundings& rig, const std::string& place, Random& random) {
  const Index i = sensor_at(*rig.plan, place);
  const double sign = either_sign(random), level = rig.sensor_std(i), seconds = rig.duration_s;
  const std::string unit = rig.plan->sensors[static_cast<std::size_t>(i)].unit;
  return Formed{1e-4 * level / seconds, 2 * level / seconds, [=](double size) {
                  const auto step = [=](Matrix& y, Index lead, double rate) {
                    for (Index k = lead; k < y.cols(); ++k)
                      y(i, k) += sign * size * static_cast<double>(k - lead) / rate;
                  };
                  return TrueEffect{.strength = sign * size, .unit = unit + "/s", .sensors = {step}};
                }};
}

}  // namespace

std::vector<EffectKind> textbook_path_kinds() {
  return {{"actuator_lag", "drive of first order", actuators, slow_drive, true},
          {"saturation", "hard end of stroke", actuators, clipped_drive, true},
          {"rate_limit", "slew limiter", actuators, slew_limited_drive, true},
          {"sensor_lag", "sensor of first order", sensor_places, slow_sensor, true},
          {"drift", "ramp", sensor_places, ramp, true}};
}

}  // namespace wheelhop::blind
