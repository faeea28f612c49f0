#include "core/gap/evidence/tone.hpp"

#include <algorithm>
#include <cmath>

#include "core/data/spectra.hpp"
#include "core/plant/linearise.hpp"

namespace wheelhop {
namespace {

constexpr Index kHalfWidth = 2;  // lines to either side: the main lobe of a Hann window
constexpr Index kSlowest = 3;    // periods in a record; slower ones are drift
// Judgements: share of an error from which most of it is one tone, and of a drive from which the tone is the drive's.
constexpr double kMostOfIt = 0.5, kOfDrive = 0.2;
// Judgements: relative distance from a natural frequency, and damping of its mode, up to which the plant rings there.
constexpr double kNearMode = 0.2, kRings = 0.2;

/// Share of a spectrum's power in the lines about one of them.
double share_about(const Vector& power, Index line) {
  const Index first = std::max<Index>(line - kHalfWidth, 0);
  const Index last = std::min(line + kHalfWidth, power.size() - 1);
  const double all = power.sum();
  return all > 0 && last >= first ? power.segment(first, last - first + 1).sum() / all : 0;
}

/// The line about which power is centred, in numbers of lines from zero.
double centre_about(const Vector& power, Index line) {
  const Index first = std::max<Index>(line - kHalfWidth, 0);
  const Index count = std::min(line + kHalfWidth, power.size() - 1) - first + 1;
  const Vector numbers = Vector::LinSpaced(count, static_cast<double>(first), static_cast<double>(first + count - 1));
  const Vector about = power.segment(first, count);
  return about.dot(numbers) / about.sum();
}

/// The strongest line that is not drift.
Index strongest_line(const Vector& power) {
  Index line = 0;
  power.tail(power.size() - kSlowest).maxCoeff(&line);
  return line + kSlowest;
}

/// How many times the tone of a drive a line is; 0 where the drive is no tone, or the line no multiple of it. The
/// centre of either is taken to be known to half a line, a judgement: a record with few periods of the drive tells no
/// multiples.
int multiple_of_drive(const Vector& drive, double centre) {
  Vector moving = drive;
  moving.head(kSlowest).setZero();
  const Index line = strongest_line(moving);
  if (!(share_about(moving, line) > kMostOfIt)) return 0;
  const double own = centre_about(moving, line), times = std::round(centre / own);
  const bool multiple = times >= 2 && std::abs(centre - times * own) < 0.5 * (1 + times);
  // A multiple so high that every line is near one tells nothing.
  return multiple && 2 * (1 + times) < own ? static_cast<int>(times) : 0;
}

/// True near a frequency at which the plant rings by itself.
bool rings_at(const LinearPlant& linear, double frequency_hz) {
  if (linear.A.size() == 0) return false;
  const std::vector<Mode> list = modes(linear.A);
  return std::any_of(list.begin(), list.end(), [&](const Mode& mode) {
    return mode.damping_ratio < kRings && std::abs(frequency_hz - mode.frequency_hz) < kNearMode * mode.frequency_hz;
  });
}

}  // namespace

Tone tone_of(const PlantFit& fit, const std::vector<FitRecord>& records) {
  Tone tone;
  std::size_t longest = 0;
  for (std::size_t i = 0; i < fit.error.size(); ++i)
    if (records[i].y.cols() > records[longest].y.cols()) longest = i;
  if (fit.error.empty() || never_moves(records[longest].drive)) return tone;
  const FitRecord& record = records[longest];
  const Matrix error = fit.error[longest].rightCols(fit.error[longest].cols() - record.skip);
  if (error.cols() < 4 * kSlowest) return tone;
  const Matrix power = hann_spectrum(error).cwiseAbs2();
  const Matrix moved = record.drive.middleCols(record.skip * record.ratio, error.cols() * record.ratio);
  const Matrix of_drive = hann_spectrum(moved).cwiseAbs2();
  const LinearPlant linear = linearise(fit.plant);
  double largest = 0;
  for (Index i = 0; i < power.rows(); ++i) {
    const Vector own = power.row(i);
    const Index line = strongest_line(own);
    const double share = share_about(own, line), size = own.sum() / (record.weight_std(i) * record.weight_std(i));
    bool driven = false;
    for (Index k = 0; k < of_drive.rows(); ++k)
      driven = driven || share_about(of_drive.row(k).transpose(), line) > kOfDrive;
    if (driven || !(share > kMostOfIt) || !(size > largest)) continue;
    const double centre = centre_about(own, line);
    const double record_s = static_cast<double>(error.cols() * record.ratio) / fit.plant.hold_hz();
    const double frequency_hz = centre / record_s;
    if (rings_at(linear, frequency_hz)) continue;
    largest = size;
    tone = {true, fit.plant.sensors[static_cast<std::size_t>(i)].name, frequency_hz, share, 0};
    for (Index k = 0; k < of_drive.rows() && tone.multiple == 0; ++k)
      tone.multiple = multiple_of_drive(of_drive.row(k).transpose(), centre);
  }
  return tone;
}

}  // namespace wheelhop
