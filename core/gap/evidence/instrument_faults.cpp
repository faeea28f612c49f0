#include "core/gap/evidence/instrument_faults.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/data/slow_channels.hpp"
#include "core/data/spectra.hpp"
#include "core/plant/dataset.hpp"

namespace wheelhop {
namespace {

// All judgements: what no calibration error, and hardly any effect in a plant, makes of a channel.
constexpr double kTimesOff = 2;       // times too large or too small
constexpr double kGoes = 0.8;         // correlation with the plant
constexpr double kAlike = 0.4;        // by which the factors of all channels may differ where the drive's is wrong
constexpr double kMatters = 0.05;     // share of all channels that a drive explains, for its factor to be told
constexpr double kExchanged = 0.1;    // of what two channels leave as they are, what they leave once exchanged
constexpr double kOfError = 0.5;      // share of a channel's squared error that an offset makes
constexpr double kOfMotion = 0.25;    // offset over the RMS of the motion
constexpr double kUnitError = 0.03;   // by which a factor may miss that of a unit
constexpr double kGravity = 9.80665;  // m/s^2 in g
constexpr Index kWindows = 8;         // of a record, in each of which a delay is measured
constexpr double kLeastSamples = 3;   // that a clock is off by at the end of a record
constexpr double kOnLine = 0.1;       // scatter of the delays about their line, over what the line spans

/// True of an accelerometer; what reads an angle's turns with the ground's gravity as without.
bool feels_gravity(const Sensor& sensor) { return sensor.kind == SensorKind::acceleration && sensor.unit != "rad/s^2"; }

/// Regression of a channel on what the plant makes of the drive.
struct Regression {
  double count = 0, y = 0, plant = 0, yy = 0, yp = 0, pp = 0;

  double var(double square, double sum) const { return square / count - sum * sum / count / count; }
  double power() const { return var(yy, y); }  // of the reading, about its mean
  double plant_power() const { return var(pp, plant); }
  double common() const { return yp / count - y * plant / count / count; }
  double reads() const { return common() / plant_power(); }
  double correlation() const { return common() / std::sqrt(power() * plant_power()); }
  double offset(double gain) const { return (y - gain * plant) / count; }
  double error(double gain) const { return power() - 2 * gain * common() + gain * gain * plant_power(); }
};

std::vector<Regression> regressions(const PlantFit& fit, const std::vector<FitRecord>& records) {
  std::vector<Regression> list(static_cast<std::size_t>(fit.plant.sensor_count()));
  for (std::size_t i = 0; i < fit.error.size(); ++i) {
    const Index kept = records[i].y.cols() - records[i].skip;
    for (Index j = 0; j < fit.plant.sensor_count(); ++j) {
      const Vector y = records[i].y.row(j).tail(kept).transpose();
      const Vector plant = y + fit.error[i].row(j).tail(kept).transpose();
      Regression& own = list[static_cast<std::size_t>(j)];
      own.count += static_cast<double>(kept);
      own.y += y.sum();
      own.plant += plant.sum();
      own.yy += y.squaredNorm();
      own.yp += y.dot(plant);
      own.pp += plant.squaredNorm();
    }
  }
  return list;
}

std::vector<const PlantInput*> moving_inputs(const Plant& plant) {
  std::vector<const PlantInput*> moving;
  for (const PlantInput& input : plant.inputs)
    if (input.moves()) moving.push_back(&input);
  return moving;
}

Place location_of_sensor(const Plant& plant, std::size_t j) { return sensor_place(plant.sensors[j].name); }

/// The wrong factors: of single channels, or of the drive.
std::vector<InstrumentFault> wrong_factors(const Plant& plant, const std::vector<Regression>& channels) {
  std::vector<InstrumentFault> faults;
  for (std::size_t j = 0; j < channels.size(); ++j) {
    const double reads = channels[j].reads();
    if (std::abs(channels[j].correlation()) > kGoes && !(reads > 1 / kTimesOff && reads < kTimesOff))
      faults.push_back({"gain_error", location_of_sensor(plant, j), reads});
  }
  const auto alike = [&](const InstrumentFault& one) {
    return std::abs(one.value - faults.front().value) < kAlike * std::abs(faults.front().value);
  };
  if (faults.size() < 2 || faults.size() < channels.size() || !std::all_of(faults.begin(), faults.end(), alike) ||
      moving_inputs(plant).size() != 1)
    return faults;
  const double mean = std::accumulate(faults.begin(), faults.end(), 0.0,
                                      [](double sum, const InstrumentFault& one) { return sum + one.value; }) /
                      static_cast<double>(faults.size());
  const auto off_by = [&](double factor) { return std::abs(mean / factor - 1) < kUnitError; };
  const bool in_g = std::all_of(plant.sensors.begin(), plant.sensors.end(), feels_gravity) &&
                    (off_by(kGravity) || off_by(1 / kGravity));
  if (in_g) return faults;
  return {{"gain_error", actuator_of(plant, *moving_inputs(plant).front()), mean}};
}

/// Readings about their mean, one channel after the other, each over its own norm.
Vector shapes_of(const Matrix& readings, const Vector& norms) {
  Matrix shapes = (readings.colwise() - readings.rowwise().mean()).transpose();
  for (Index j = 0; j < shapes.cols(); ++j) shapes.col(j) /= norms(j);
  return shapes.reshaped();
}

/// Wrong factors of single drives among several.
std::vector<InstrumentFault> wrong_drives(const PlantFit& fit, const std::vector<FitRecord>& records) {
  const Plant& plant = fit.plant;
  const std::vector<const PlantInput*> inputs = moving_inputs(plant);
  const auto m = static_cast<Index>(inputs.size()), p = plant.sensor_count();
  if (m < 2 || fit.error.empty()) return {};
  Matrix H = Matrix::Zero(m, m);
  Vector g = Vector::Zero(m);
  double all = 0;
  for (const FitRecord& record : records) {
    const Index kept = record.y.cols() - record.skip;
    const Matrix y = record.y.rightCols(kept);
    const Vector norms = (y.colwise() - y.rowwise().mean()).rowwise().norm();
    if (!(norms.minCoeff() > 0)) return {};
    Matrix under(p * kept, m);
    for (Index i = 0; i < m; ++i) {
      Matrix drive = record.drive;
      for (Index j = 0; j < m; ++j)
        if (const Index row = inputs[static_cast<std::size_t>(j)] - plant.inputs.data(); j != i)
          drive.row(row).setConstant(record.drive(row, 0));
      Simulation run = simulate_measured(plant, drive, run_options(plant, record));
      if (run.status != Status::ok || run.outputs.cols() < record.y.cols()) return {};
      as_logged(record.slow, run.outputs);
      under.col(i) = shapes_of(run.outputs.middleCols(record.skip, kept), norms);
    }
    const Vector read = shapes_of(y, norms);
    H += under.transpose() * under;
    g += under.transpose() * read;
    all += read.squaredNorm();
  }
  const Eigen::LDLT<Matrix> factor(H);
  const Vector common = g;
  g = factor.solve(common);
  if (!(common.dot(g) > kGoes * kGoes * all)) return {};
  const Matrix inverse = factor.solve(Matrix::Identity(m, m));
  std::vector<InstrumentFault> faults;
  for (Index i = 0; i < m; ++i)
    if (!(g(i) > 1 / kTimesOff && g(i) < kTimesOff) && g(i) * g(i) / inverse(i, i) > kMatters * all)
      faults.push_back({"gain_error", actuator_of(plant, *inputs[static_cast<std::size_t>(i)]), g(i)});
  return faults;
}

/// Samples by which b lies behind a, from the largest of their cross-correlation, between the samples by a parabola;
/// NaN where they do not go together. Both about their means; half a window at most.
double lies_behind(const Vector& a, const Vector& b) {
  const Index n = a.size();
  Matrix padded = Matrix::Zero(2, 2 * n);
  padded.row(0).head(n) = (a.array() - a.mean()).matrix().transpose();
  padded.row(1).head(n) = (b.array() - b.mean()).matrix().transpose();
  const double norm = padded.row(0).norm() * padded.row(1).norm();
  const ComplexMatrix spectrum = fft(padded);
  const ComplexMatrix cross = spectrum.row(0).conjugate().cwiseProduct(spectrum.row(1));
  const Vector r = inverse_fft(cross, 2 * n).transpose();  // r(k): a of earlier by k against b
  const auto at = [&](Index lag) { return r((lag + 2 * n) % (2 * n)); };
  Index best = 0;
  for (Index lag = -n / 2; lag <= n / 2; ++lag)
    if (at(lag) > at(best)) best = lag;
  // What moves out of the window is missing from the correlation.
  const double overlap = 1 - static_cast<double>(std::abs(best)) / static_cast<double>(n);
  if (!(at(best) > kGoes * overlap * norm) || std::abs(best) == n / 2) return kUnknown;
  const double curvature = at(best + 1) - 2 * at(best) + at(best - 1);
  return static_cast<double>(best) + (curvature < 0 ? 0.5 * (at(best - 1) - at(best + 1)) / curvature : 0);
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Rate at which the records fall behind the plant, samples a sample; 0 where they do not, or not alike. By the median
/// slope of all pairs of windows (Theil 1950; Sen 1968, J. Am. Stat. Assoc. 63, 1379), which single windows cannot
/// mislead.
double falls_behind(const PlantFit& fit, const std::vector<FitRecord>& records) {
  std::vector<double> slopes, residuals;
  double span = 0;
  struct Delay {
    double at, behind;
  };
  std::vector<std::vector<Delay>> series;
  for (std::size_t i = 0; i < fit.error.size(); ++i) {
    const Index window = (records[i].y.cols() - records[i].skip) / kWindows;
    if (window < 4 * kWindows || never_moves(records[i].drive)) continue;  // a decay has no clock but the recorder's
    span = std::max(span, static_cast<double>(window * kWindows));
    for (Index j = 0; j < records[i].y.rows(); ++j) {
      series.emplace_back();
      for (Index w = 0; w < kWindows; ++w) {
        const Index from = records[i].skip + w * window;
        const Vector y = records[i].y.row(j).segment(from, window).transpose();
        const Vector plant = y + fit.error[i].row(j).segment(from, window).transpose();
        const double behind = lies_behind(plant, y);
        if (std::isfinite(behind))
          series.back().push_back({static_cast<double>(from) + 0.5 * static_cast<double>(window), behind});
      }
      for (const Delay& a : series.back())
        for (const Delay& b : series.back())
          if (b.at > a.at) slopes.push_back((b.behind - a.behind) / (b.at - a.at));
    }
  }
  if (slopes.size() < static_cast<std::size_t>(kWindows)) return 0;
  const double slope = median(slopes);
  if (!(std::abs(slope) * span > kLeastSamples)) return 0;
  for (const std::vector<Delay>& own : series) {
    if (own.empty()) continue;
    std::vector<double> starts;
    for (const Delay& delay : own) starts.push_back(delay.behind - slope * delay.at);
    const double start = median(starts);
    for (const double other : starts) residuals.push_back(std::abs(other - start));
  }
  return median(residuals) < std::max(kOnLine * std::abs(slope) * span, 0.5) ? slope : 0;
}

}  // namespace

std::vector<InstrumentFault> gross_faults(const PlantFit& fit, const std::vector<FitRecord>& records) {
  const std::vector<Regression> channels = regressions(fit, records);
  // Under several drives one channel may hang on a single drive, and its factor is that drive's.
  std::vector<InstrumentFault> faults = wrong_drives(fit, records);
  if (faults.empty()) faults = wrong_factors(fit.plant, channels);
  const bool scaled = !faults.empty();
  const bool drive = scaled && faults.front().location.kind == PlaceKind::actuator;
  for (std::size_t j = 0; j < channels.size(); ++j) {
    if (!feels_gravity(fit.plant.sensors[j])) continue;
    const Regression& own = channels[j];
    const bool off = drive || std::any_of(faults.begin(), faults.end(), [&](const InstrumentFault& fault) {
                       return fault.location == location_of_sensor(fit.plant, j);
                     });
    // The offset counts beside the factor that the channel has.
    const double gain = off ? own.reads() : 1, offset = own.offset(gain);
    if (offset * offset > kOfError * (offset * offset + own.error(gain)) &&
        std::abs(offset) > kOfMotion * std::sqrt(own.power()))
      faults.push_back({"bias", location_of_sensor(fit.plant, j), offset});
  }
  if (scaled) return faults;
  if (const double slope = falls_behind(fit, records); slope != 0)
    faults.push_back({"clock_skew", clock_place(), -slope});
  return faults;
}

std::pair<std::string, std::string> exchanged_channels(const PlantFit& fit, const std::vector<FitRecord>& records) {
  const Index p = fit.plant.sensor_count();
  Matrix apart = Matrix::Zero(p, p);  // of reading i of the plant and channel j
  Vector power = Vector::Zero(p);
  for (std::size_t r = 0; r < fit.error.size(); ++r) {
    const Index kept = records[r].y.cols() - records[r].skip;
    Matrix y = records[r].y.rightCols(kept), plant = y + fit.error[r].rightCols(kept);
    y.colwise() -= y.rowwise().mean().eval();
    plant.colwise() -= plant.rowwise().mean().eval();
    power += y.rowwise().squaredNorm();
    for (Index i = 0; i < p; ++i) apart.row(i) += (y.rowwise() - plant.row(i)).rowwise().squaredNorm().transpose();
  }
  std::pair<std::string, std::string> names;
  double least = 1 - kGoes * kGoes;
  for (Index i = 0; i < p; ++i)
    for (Index j = i + 1; j < p; ++j) {
      const Sensor &one = fit.plant.sensors[static_cast<std::size_t>(i)],
                   &other = fit.plant.sensors[static_cast<std::size_t>(j)];
      const double exchanged = apart(i, j) / power(j) + apart(j, i) / power(i);
      const double as_they_are = apart(i, i) / power(i) + apart(j, j) / power(j);
      if (one.unit != other.unit || !(exchanged < kExchanged * as_they_are) || !(exchanged < least)) continue;
      least = exchanged;
      names = {one.name, other.name};
    }
  return names;
}

}  // namespace wheelhop
