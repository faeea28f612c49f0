// Effects between command and plant, between plant and record, and of their clocks.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "experiments/rig/effects.hpp"

namespace wheelhop::blind {
namespace {

/// s'' = w^2 (u - s) - 2 zeta w s', |s'| <= limit, on samples joined by straight lines, in RK4 steps that resolve w;
/// starts settled.
void second_order(Eigen::Ref<Vector> u, double rate_hz, double cutoff_hz, double ratio, double limit) {
  const double w = 2 * std::numbers::pi * cutoff_hz;
  const auto steps = static_cast<int>(std::ceil(4 * w / rate_hz)) + 1;
  const double h = 1 / (rate_hz * steps);
  double s = u.size() > 0 ? u(0) : 0, r = 0;
  const auto slope = [&](double rate) { return std::clamp(rate, -limit, limit); };
  const auto pull = [&](double in, double x, double rate) { return w * w * (in - x) - 2 * ratio * w * rate; };
  double before = u.size() > 0 ? u(0) : 0;
  for (Index k = 1; k < u.size(); ++k) {
    const double now = u(k);
    for (int i = 0; i < steps; ++i) {
      const auto in = [&](double part) { return before + (now - before) * (i + part) / steps; };
      const double a1 = pull(in(0), s, r), v1 = slope(r);
      const double a2 = pull(in(0.5), s + h / 2 * v1, r + h / 2 * a1), v2 = slope(r + h / 2 * a1);
      const double a3 = pull(in(0.5), s + h / 2 * v2, r + h / 2 * a2), v3 = slope(r + h / 2 * a2);
      const double a4 = pull(in(1), s + h * v3, r + h * a3), v4 = slope(r + h * a3);
      s += h / 6 * (v1 + 2 * v2 + 2 * v3 + v4);
      r = slope(r + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4));
    }
    before = now;
    u(k) = s;
  }
}

TrueEffect drive_effect(DriveStep step, double strength, std::string unit) {
  return {.strength = strength, .unit = std::move(unit), .drive = {std::move(step)}};
}

std::optional<Formed> lag(const Surroundings& rig, const std::string& place, Random& random) {
  const Index i = input_at(*rig.plan, place);
  const double ratio = between(random, 0.55, 0.9), limit = rig.input_speed_rms(i) * between(random, 3.5, 6);
  const double band = rig.band_hz;
  return Formed{0.01 / band, 1.5 / band, [=](double size) {
                  const auto change = [=](Vector& u, double rate) { second_order(u, rate, 1 / size, ratio, limit); };
                  return drive_effect({.input = i, .change = change}, 1 / size, "Hz");
                }};
}

std::optional<Formed> delay(const Surroundings& rig, const std::string& place, Random&) {
  const Index i = input_at(*rig.plan, place);
  return Formed{1e-6, 0.5 / rig.band_hz,
                [=](double size) { return drive_effect({.input = i, .delay_s = size, .change = {}}, size, "s"); }};
}

std::optional<Formed> drive_gain(const Surroundings& rig, const std::string& place, Random& random) {
  const Index i = input_at(*rig.plan, place);
  const double sign = either_sign(random);
  return Formed{1e-4, 0.4, [=](double size) {
                  const auto change = [=](Vector& u, double) { u *= 1 + sign * size; };
                  return drive_effect({.input = i, .change = change}, sign * size, "-");
                }};
}

/// The command bends toward the end of the stroke instead of being cut: u / (1 + |u / L|^6)^(1/6).
std::optional<Formed> soft_limit(const Surroundings& rig, const std::string& place, Random&) {
  const Index i = input_at(*rig.plan, place);
  const double peak = rig.input_peak(i);
  if (!(peak > 0)) return std::nullopt;
  return Formed{0.3, 4, [=, unit = rig.plan->inputs[static_cast<std::size_t>(i)].unit](double size) {
                  const double limit = peak / size;
                  const auto change = [=](Vector& u, double) {
                    for (double& value : u) value /= std::pow(1 + std::pow(std::abs(value / limit), 6), 1.0 / 6);
                  };
                  return drive_effect({.input = i, .change = change}, limit, unit);
                }};
}

/// A servo that follows with feed-forward, at a speed that its valve bounds.
std::optional<Formed> servo_speed(const Surroundings& rig, const std::string& place, Random& random) {
  const Index i = input_at(*rig.plan, place);
  const double speed = rig.input_speed_rms(i), time = between(random, 2e-3, 5e-3);
  if (!(speed > 0)) return std::nullopt;
  return Formed{0.15, 2.5, [=, unit = rig.plan->inputs[static_cast<std::size_t>(i)].unit](double size) {
                  const double limit = speed / size;
                  const auto change = [=](Vector& u, double rate) {
                    double s = u.size() > 0 ? u(0) : 0, before = s;
                    const double keep = std::exp(-1 / (rate * time));
                    for (double& value : u) {
                      const double wanted = value - (before - s) * keep;
                      before = value;
                      value = s = s + std::clamp(wanted - s, -limit / rate, limit / rate);
                    }
                  };
                  return drive_effect({.input = i, .change = change}, limit, unit + "/s");
                }};
}

std::optional<Formed> skew(const Surroundings& rig, const std::string&, Random& random) {
  const double sign = either_sign(random);
  const auto inputs = static_cast<Index>(rig.plan->inputs.size());
  return Formed{1e-7, 2e-3, [=](double size) {
                  TrueEffect result{.strength = sign * size, .unit = "-"};
                  for (Index i = 0; i < inputs; ++i)
                    result.drive.push_back({.input = i, .rate = 1 + sign * size, .change = {}});
                  return result;
                }};
}

TrueEffect sensor_effect(SensorStep step, double strength, std::string unit) {
  return {.strength = strength, .unit = std::move(unit), .sensors = {std::move(step)}};
}

std::string unit_of(const Surroundings& rig, Index sensor) {
  return rig.plan->sensors[static_cast<std::size_t>(sensor)].unit;
}

std::optional<Formed> sensor_gain(const Surroundings& rig, const std::string& place, Random& random) {
  const Index i = sensor_at(*rig.plan, place);
  const double sign = either_sign(random);
  return Formed{1e-4, 0.4, [=](double size) {
                  return sensor_effect([=](Matrix& y, Index, double) { y.row(i) *= 1 + sign * size; }, sign * size,
                                       "-");
                }};
}

std::optional<Formed> bias(const Surroundings& rig, const std::string& place, Random& random) {
  const Index i = sensor_at(*rig.plan, place);
  const double sign = either_sign(random), level = rig.sensor_std(i);
  return Formed{1e-4 * level, level, [=, unit = unit_of(rig, i)](double size) {
                  return sensor_effect([=](Matrix& y, Index, double) { y.row(i).array() += sign * size; }, sign * size,
                                       unit);
                }};
}

/// Warming electronics: the offset approaches its end value from the start of the record.
std::optional<Formed> warm_up(const Surroundings& rig, const std::string& place, Random& random) {
  const Index i = sensor_at(*rig.plan, place);
  const double sign = either_sign(random), level = rig.sensor_std(i), time = rig.duration_s * between(random, 0.4, 1.2);
  return Formed{1e-4 * level, 2 * level, [=, unit = unit_of(rig, i)](double size) {
                  const auto step = [=](Matrix& y, Index lead, double rate) {
                    for (Index k = lead; k < y.cols(); ++k)
                      y(i, k) -= sign * size * std::expm1(-static_cast<double>(k - lead) / (rate * time));
                  };
                  return sensor_effect(step, sign * size, unit);
                }};
}

std::optional<Formed> crosstalk(const Surroundings& rig, const std::string& place, Random& random) {
  const Index i = sensor_at(*rig.plan, place), sensors = rig.sensor_rms.size();
  if (sensors < 2) return std::nullopt;
  const Index other = (i + 1 + random.integer(sensors - 1)) % sensors;
  const double sign = either_sign(random), usual = rig.sensor_std(i) / rig.sensor_std(other);
  return Formed{1e-4 * usual, 0.5 * usual, [=](double size) {
                  return sensor_effect([=](Matrix& y, Index, double) { y.row(i) += sign * size * y.row(other); },
                                       sign * size, "-");
                }};
}

std::optional<Formed> quantisation(const Surroundings& rig, const std::string& place, Random&) {
  const Index i = sensor_at(*rig.plan, place);
  const double level = rig.sensor_std(i);
  return Formed{1e-3 * level, level, [=, unit = unit_of(rig, i)](double size) {
                  return TrueEffect{.strength = size, .unit = unit, .quanta = {{i, size}}};
                }};
}

/// An anti-alias filter: Bessel of second order.
std::optional<Formed> bessel(const Surroundings& rig, const std::string& place, Random&) {
  const Index i = sensor_at(*rig.plan, place);
  constexpr double damping_ratio = 0.8660254037844386;
  return Formed{1e-3 / rig.band_hz, 1 / rig.band_hz, [=](double size) {
                  const auto step = [=](Matrix& y, Index, double rate) {
                    Vector reading = y.row(i).transpose();
                    second_order(reading, rate, 1 / size, damping_ratio, std::numeric_limits<double>::infinity());
                    y.row(i) = reading.transpose();
                  };
                  return sensor_effect(step, 1 / size, "Hz");
                }};
}

}  // namespace

std::vector<EffectKind> drive_kinds() {
  return {{"actuator_lag", "second order with rate limit", actuators, lag},
          {"time_delay", "pure delay", actuators, delay},
          {"gain_error", "gain of the drive", actuators, drive_gain},
          {"saturation", "soft end of stroke", actuators, soft_limit},
          {"rate_limit", "servo of bounded speed", actuators, servo_speed},
          {"clock_skew", "clock of the drive", timebase, skew}};
}

std::vector<EffectKind> sensor_kinds() {
  return {{"gain_error", "gain of a sensor", sensor_places, sensor_gain},
          {"bias", "constant", sensor_places, bias},
          {"drift", "warm-up", sensor_places, warm_up},
          {"crosstalk", "proportional", sensor_places, crosstalk},
          {"quantisation", "converter", sensor_places, quantisation},
          {"sensor_lag", "Bessel of second order", sensor_places, bessel}};
}

}  // namespace wheelhop::blind
