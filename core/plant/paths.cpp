#include "core/plant/paths.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/plant/plant.hpp"

namespace wheelhop {
namespace {

constexpr Index half_width = 16;

/// Weights of the samples j = 1 - half_width ... half_width about a point a fraction (0 < f < 1) behind sample 0. The
/// angles of sinc and window are sums, so that one sine and cosine serve all samples.
class Interpolator {
 public:
  Interpolator() {
    for (Index j = 0; j < taps; ++j) {
      const double angle = std::numbers::pi * offset(j) / half_width;
      cosine_[at(j)] = std::cos(angle);
      sine_[at(j)] = std::sin(angle);
    }
  }
  double operator()(ConstVectorRef u, Index whole, double fraction) {
    if (fraction != fraction_) prepare(fraction);
    double sum = 0;
    for (Index j = 0; j < taps; ++j)
      sum += weights_[at(j)] * u(std::clamp<Index>(whole + j + 1 - half_width, 0, u.size() - 1));
    return sum;
  }

 private:
  static constexpr Index taps = 2 * half_width;
  static std::size_t at(Index j) { return static_cast<std::size_t>(j); }
  static double offset(Index j) { return static_cast<double>(j + 1 - half_width); }

  void prepare(double fraction) {
    const double angle = std::numbers::pi * fraction / half_width;
    const double cosine = std::cos(angle), sine = std::sin(angle);
    double sum = 0;
    for (Index j = 0; j < taps; ++j) {
      const double c = cosine_[at(j)] * cosine + sine_[at(j)] * sine;
      const double window =
          0.35875 + 0.48829 * c + 0.14128 * (2 * c * c - 1) + 0.01168 * c * (4 * c * c - 3);  // Blackman-Harris
      const double sign = j % 2 == 0 ? 1 : -1;
      weights_[at(j)] = sign * window / (offset(j) - fraction);
      sum += weights_[at(j)];
    }
    for (double& weight : weights_) weight /= sum;  // constants are kept
    fraction_ = fraction;
  }

  std::array<double, taps> cosine_, sine_, weights_;
  double fraction_ = -1;
};

/// x' = A x + b u, y = c x over straight pieces of u: x_{k+1} = A_d x_k + at_start u_k + slope (u_{k+1} - u_k).
Vector filter(const Matrix& A, const Vector& b, const Eigen::RowVectorXd& c, ConstVectorRef u, double step_s) {
  const Index n = A.rows();
  Matrix joint = Matrix::Zero(n + 2, n + 2);
  joint.topLeftCorner(n, n) = A * step_s;
  joint.block(0, n, n, 1) = b * step_s;
  joint(n, n + 1) = 1;
  const Matrix step = matrix_exponential(joint);
  // Straight pieces weaken a sine by 1 - (w T)^2 / 12: put back in advance by the second difference.
  Vector sharp = u;
  for (Index k = 1; k + 1 < u.size(); ++k) sharp(k) -= (u(k + 1) - 2 * u(k) + u(k - 1)) / 12;
  Vector x = -A.partialPivLu().solve(b) * u(0), y(u.size());
  for (Index k = 0; k < u.size(); ++k) {
    y(k) = c * x;
    if (k + 1 < u.size())
      x = (step.topLeftCorner(n, n) * x + step.col(n).head(n) * sharp(k) +
           step.col(n + 1).head(n) * (sharp(k + 1) - sharp(k)))
              .eval();
  }
  return y;
}

/// Ends at +-limit, hard or, of a finite sharpness, soft. Infinite: none.
void saturate(double limit, double sharpness, Vector& u) {
  if (!std::isfinite(limit)) return;
  if (std::isfinite(sharpness))
    for (double& value : u) value /= std::pow(1 + std::pow(std::abs(value / limit), sharpness), 1 / sharpness);
  else
    u = u.cwiseMax(-limit).cwiseMin(limit);
}

/// Follows a signal no faster than a limit, from its first value on. @param limit unit/s, infinite: none
void limit_rate(double limit, double rate_hz, Vector& u) {
  if (!std::isfinite(limit)) return;
  const double most = limit / rate_hz;
  for (Index k = 1; k < u.size(); ++k) u(k) = u(k - 1) + std::clamp(u(k) - u(k - 1), -most, most);
}

}  // namespace

Vector resample_on_grid(ConstVectorRef u, double delay_samples, double skew, Index first_sample) {
  if (delay_samples == 0 && skew == 0) return u;
  Interpolator interpolate;
  Vector result(u.size());
  for (Index k = 0; k < u.size(); ++k) {
    const double shift = skew * static_cast<double>(k - first_sample) - delay_samples;
    // Beyond the record the command is held; the bound keeps the cast defined whatever a fit tries.
    const double place =
        std::clamp(static_cast<double>(k) + shift, -1.0 - half_width, static_cast<double>(u.size() + half_width));
    const double whole = std::floor(place), fraction = place - whole;
    const auto index = static_cast<Index>(whole);
    // A delay of whole samples up to round-off is a shift; nearer to a sample the weights would divide by zero.
    if (fraction < 1e-9 || fraction > 1 - 1e-9)
      result(k) = u(std::clamp<Index>(index + (fraction > 0.5), 0, u.size() - 1));
    else
      result(k) = interpolate(u, index, fraction);
  }
  return result;
}

Index drive_samples_read(const Plant& plant, Index count) {
  const auto interpolates = [](const PlantInput& input) {
    return input.path.delay_s != 0 || input.path.sampling_phase != 0;
  };
  const bool between = plant.clock_skew != 0 || std::any_of(plant.inputs.begin(), plant.inputs.end(), interpolates);
  const double faster = std::ceil(static_cast<double>(count) * std::max(plant.clock_skew, 0.0));
  return count + (between ? static_cast<Index>(faster) + half_width : 0);
}

Vector apply_lag(const Lag& lag, ConstVectorRef u, double rate_hz) {
  Vector y = u;
  if (u.size() == 0) return y;
  if (lag.time_constant_s > 0)
    y = filter(Matrix::Constant(1, 1, -1 / lag.time_constant_s), Vector::Constant(1, 1 / lag.time_constant_s),
               Eigen::RowVectorXd::Ones(1), y, 1 / rate_hz);
  if (std::isfinite(lag.cutoff_hz)) {
    const double w = 2 * std::numbers::pi * lag.cutoff_hz;
    const Matrix A = (Matrix(2, 2) << 0, w, -w, -2 * lag.damping_ratio * w).finished();
    const Vector b = (Vector(2) << 0, w).finished();
    y = filter(A, b, (Eigen::RowVectorXd(2) << 1, 0).finished(), y, 1 / rate_hz);
  }
  return y;
}

Matrix apply_drive_paths(const Plant& plant, ConstMatrixRef drive, Index first_sample) {
  Matrix felt = drive;
  const double hold_hz = plant.hold_hz();
  for (Index i = 0; i < felt.rows(); ++i) {
    const DrivePath& path = plant.inputs[static_cast<std::size_t>(i)].path;
    Vector u = drive.row(i).transpose();
    u = resample_on_grid(u, path.delay_s * hold_hz, plant.clock_skew, first_sample);
    if (path.gain != 1 || path.offset != 0) u = (path.gain * u).array() + path.offset;
    u = apply_lag(path.lag, u, hold_hz);
    limit_rate(path.rate_limit, hold_hz, u);
    saturate(path.saturation, path.saturation_sharpness, u);
    felt.row(i) = u.transpose();
  }
  return felt;
}

bool same_drive_paths(const Plant& a, const Plant& b) {
  return a.clock_skew == b.clock_skew &&
         std::equal(a.inputs.begin(), a.inputs.end(), b.inputs.begin(), b.inputs.end(),
                    [](const PlantInput& one, const PlantInput& other) { return one.path == other.path; });
}

Matrix drive_at_samples(const Plant& plant, ConstMatrixRef felt) {
  const auto in_step = [](const PlantInput& input) { return input.path.sampling_phase == 0; };
  if (std::all_of(plant.inputs.begin(), plant.inputs.end(), in_step)) return {};
  Matrix sampled = felt;
  for (Index i = 0; i < felt.rows(); ++i)
    sampled.row(i) =
        resample_on_grid(felt.row(i).transpose(), plant.inputs[static_cast<std::size_t>(i)].path.sampling_phase, 0, 0)
            .transpose();
  return sampled;
}

bool any_sensor_lags(const Plant& plant) {
  return std::any_of(plant.sensors.begin(), plant.sensors.end(), [](const Sensor& sensor) {
    return sensor.path.lag.time_constant_s > 0 || std::isfinite(sensor.path.lag.cutoff_hz) ||
           std::isfinite(sensor.path.rate_limit) || sensor.path.delay_s != 0;
  });
}

Matrix apply_sensor_paths(const Plant& plant, ConstMatrixRef ideal, double rate_hz, const Vector& stored) {
  Matrix readings = ideal;
  for (Index i = 0; i < readings.rows(); ++i) {
    const SensorPath& path = plant.sensors[static_cast<std::size_t>(i)].path;
    Vector y = ideal.row(i).transpose();
    if (path.gain != 1) y *= path.gain;
    for (const auto& [channel, factor] : path.crosstalk)
      for (Index other = 0; other < ideal.rows(); ++other)
        if (plant.sensors[static_cast<std::size_t>(other)].name == channel) y += factor * ideal.row(other).transpose();
    y = resample_on_grid(y, path.delay_s * rate_hz, 0, 0);
    y = apply_lag(path.lag, y, rate_hz);
    if (path.high_pass_hz > 0) {
      const double corner = 2 * std::numbers::pi * path.high_pass_hz;
      const double beyond = stored.size() > 0 && y.size() > 0 && std::isfinite(stored(i)) ? stored(i) - y(0) : 0;
      y -= apply_lag({.time_constant_s = 1 / corner}, y, rate_hz);
      for (Index k = 0; k < y.size() && beyond != 0; ++k)
        y(k) -= beyond * std::exp(-corner * static_cast<double>(k) / rate_hz);
    }
    if (path.bias != 0 || path.drift_per_s != 0)
      for (Index k = 0; k < y.size(); ++k) {
        const double t = static_cast<double>(k) / rate_hz, settling = path.drift_settling_per_s;
        y(k) += path.bias + path.drift_per_s * (settling > 0 ? -std::expm1(-settling * t) / settling : t);
      }
    limit_rate(path.rate_limit, rate_hz, y);
    readings.row(i) = y.transpose();
  }
  convert_readings(plant, readings);
  return readings;
}

void convert_readings(const Plant& plant, Matrix& readings) {
  for (Index i = 0; i < readings.rows(); ++i) {
    const SensorPath& path = plant.sensors[static_cast<std::size_t>(i)].path;
    const double quantum = path.quantum;
    if (std::isfinite(path.saturation)) {
      Vector y = readings.row(i).transpose();
      saturate(path.saturation, path.saturation_sharpness, y);
      readings.row(i) = y.transpose();
    }
    if (quantum > 0)
      for (double& value : readings.row(i)) value = quantum * std::round(value / quantum);
  }
}

Plant unconverted(Plant plant) {
  for (Sensor& sensor : plant.sensors)
    sensor.path.saturation = sensor.path.saturation_sharpness = SensorPath{}.saturation;
  return unquantised(std::move(plant));
}

Plant unquantised(Plant plant) {
  for (Sensor& sensor : plant.sensors) sensor.path.quantum = 0;
  return plant;
}

}  // namespace wheelhop
