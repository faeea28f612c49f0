#include "core/plant/road.hpp"

#include <cmath>
#include <complex>
#include <numbers>
#include <unsupported/Eigen/FFT>

#include "core/plant/butterworth.hpp"

namespace wheelhop {
namespace {

constexpr double two_pi = 2 * std::numbers::pi;

/// x_t = sum of amplitude_k cos(2 pi k t / period + phase_k) over the lines k, t = 0 ... period - 1.
class LineSum {
 public:
  explicit LineSum(Index period) : spectrum_(ComplexVector::Zero(period)) {}
  void add(Index line, double amplitude, double phase) {
    const Index period = spectrum_.size();
    const auto half = std::polar(0.5 * amplitude * static_cast<double>(period), phase);
    spectrum_(line) += half;
    spectrum_(period - line) += std::conj(half);
  }
  Vector samples() const {
    Eigen::FFT<double> fft;
    ComplexVector time(spectrum_.size());
    fft.inv(time, spectrum_);
    return time.real();
  }

 private:
  ComplexVector spectrum_;
};

Drive make(const BandLimitedNoise& o, double hold_hz, Index lead, Index samples, Random& random) {
  // 20 periods of the cutoff (2 s at 10 Hz): by then the transient of an order up to 16 has decayed.
  const auto settle = static_cast<Index>(std::ceil(20 / o.cutoff_hz * hold_hz));
  Vector x(settle + lead + samples);
  for (double& value : x) value = random.normal();
  filter(butterworth_lowpass(o.order, o.cutoff_hz, hold_hz), x);
  Drive drive;
  drive.values = x.tail(lead + samples);
  // The level decides how nonlinear a record is: the spread of the RMS of a minute of 10 Hz noise (about 3 %) would
  // move the scores of a linear model by several points from seed to seed, so every record gets the same level.
  const double rms = std::sqrt(drive.values.tail(samples).squaredNorm() / static_cast<double>(samples));
  if (rms > 0) drive.values *= o.rms / rms;
  return drive;
}

Drive make(const Multisine& o, double hold_hz, Index lead, Index samples, Random& random) {
  Drive drive;
  const auto period = static_cast<Index>(std::llround(o.period_s * hold_hz));
  drive.period_samples = period;
  const auto first = std::max<Index>(1, static_cast<Index>(std::ceil(o.from_hz * o.period_s - 1e-9)));
  const auto last = static_cast<Index>(std::floor(o.to_hz * o.period_s + 1e-9));
  std::vector<Index> candidates;
  for (Index line = first; line <= last; ++line) {
    if (o.odd_lines_only && line % 2 == 0)
      drive.even_detection_lines.push_back(line);
    else
      candidates.push_back(line);
  }
  const auto count = static_cast<Index>(candidates.size());
  Index left_out = -1;
  for (Index i = 0; i < count; ++i) {
    if (o.detection_group > 0 && i % o.detection_group == 0) left_out = i + random.integer(o.detection_group);
    const Index line = candidates[static_cast<std::size_t>(i)];
    if (i != left_out)
      drive.excited_lines.push_back(line);
    else
      (line % 2 == 0 ? drive.even_detection_lines : drive.odd_detection_lines).push_back(line);
  }
  Vector amplitude(static_cast<Index>(drive.excited_lines.size()));
  for (Index i = 0; i < amplitude.size(); ++i)
    amplitude(i) = std::pow(static_cast<double>(drive.excited_lines[static_cast<std::size_t>(i)]), -o.slope);
  amplitude *= o.rms / (amplitude.norm() * std::numbers::sqrt2 / 2);
  LineSum sum(period);
  for (Index i = 0; i < amplitude.size(); ++i)
    sum.add(drive.excited_lines[static_cast<std::size_t>(i)], amplitude(i), two_pi * random.uniform());
  const Vector one_period = sum.samples();
  drive.values.resize(lead + samples);
  for (Index i = 0; i < lead + samples; ++i) drive.values(i) = one_period(((i - lead) % period + period) % period);
  return drive;
}

Drive make(const Sweep& o, double hold_hz, Index lead, Index samples, Random&) {
  Drive drive;
  drive.values = Vector::Zero(lead + samples);
  const double duration_s = static_cast<double>(samples) / hold_hz;
  const double ratio = std::log(o.to_hz / o.from_hz);
  const bool linear = o.progress == "linear" || ratio == 0;
  for (Index i = 0; i < samples; ++i) {
    const double t = static_cast<double>(i) / hold_hz;
    const double cycles = linear ? o.from_hz * t + (o.to_hz - o.from_hz) * t * t / (2 * duration_s)
                                 : o.from_hz * duration_s / ratio * std::expm1(ratio * t / duration_s);
    drive.values(lead + i) = o.amplitude * std::sin(two_pi * cycles);
  }
  return drive;
}

Drive make(const Iso8608& o, double hold_hz, Index lead, Index samples, Random& random) {
  Index period = 1;
  while (period < lead + samples) period *= 2;
  const double roughness = 16e-6 * std::pow(4.0, o.road_class[0] - 'A');              // m^3 at 0.1 cycles/m
  const double line_width = hold_hz / static_cast<double>(period) / o.speed_m_per_s;  // cycles/m
  LineSum sum(period);
  for (Index line = 1; line < period / 2; ++line) {
    const double n = static_cast<double>(line) * line_width;
    if (n < o.from_cycles_per_m) continue;
    if (n > o.to_cycles_per_m) break;
    const double density = roughness * 0.01 / (n * n);
    sum.add(line, std::sqrt(2 * density * line_width), two_pi * random.uniform());
  }
  Drive drive;
  drive.values = sum.samples().head(lead + samples);
  return drive;
}

Drive make(const Bump& o, double hold_hz, Index lead, Index samples, Random&) {
  Drive drive;
  drive.values = Vector::Zero(lead + samples);
  for (Index i = 0; i < samples; ++i) {
    const double distance_m = (static_cast<double>(i) / hold_hz - o.start_s) * o.speed_m_per_s;
    if (distance_m > 0 && distance_m < o.length_m)
      drive.values(lead + i) = 0.5 * o.height * (1 - std::cos(two_pi * distance_m / o.length_m));
  }
  return drive;
}

Drive make(const Steps& o, double hold_hz, Index lead, Index samples, Random& random) {
  Drive drive;
  drive.values.resize(lead + samples);
  const auto length = std::max<Index>(1, std::llround(o.hold_s * hold_hz));
  for (Index i = 0; i < samples; i += length)
    drive.values.segment(lead + i, std::min(length, samples - i))
        .setConstant(o.low + (o.high - o.low) * random.uniform());
  drive.values.head(lead).setConstant(drive.values(lead));
  return drive;
}

}  // namespace

Drive make_drive(const DriveOptions& options, double hold_hz, Index lead, Index samples, Random& random) {
  return std::visit([&](const auto& o) { return make(o, hold_hz, lead, samples, random); }, options);
}

}  // namespace wheelhop
