#include <algorithm>
#include <cmath>

#include "core/data/resample.hpp"
#include "core/data/spectra.hpp"
#include "core/gap/evidence/split.hpp"

namespace wheelhop {
namespace {

constexpr double kForgets = 0.7;     // correlation below which a drive counts as past its own smoothness
constexpr double kRepeats = 0.998;   // and from which it counts as the same again: noise of 27 dB
constexpr Index kNearby = 8;         // lines over which a drive's spectrum is flat enough
constexpr double kEmpty = 1e-3;      // power of an unexcited line over that of its strongest neighbour
constexpr double kOutOfBand = 1e-5;  // power of a line's strongest neighbour over that of the strongest of all
constexpr double kEmptyLines = 0.2;  // share of them with which one period is taken for whole
constexpr double kDetection =
    0.05;  // share of a parity's lines that tells what stands on the others; noise leaves less

enum class Line : char { out_of_band, empty, excited };

/// Lines of one record, noise taken off.
struct Lines {
  std::vector<Line> drive;
  std::vector<double> power;  ///< of the error, over all channels in units of the floor; may be negative by chance
};

/// What the drive does on each line of a period; of several inputs, the most that any does.
std::vector<Line> lines_of_drive(ConstMatrixRef u_of_period) {
  const Matrix power = fft(u_of_period.colwise() - u_of_period.rowwise().mean()).cwiseAbs2();
  const Index lines = power.cols();
  std::vector<Line> drive(static_cast<std::size_t>(lines), Line::out_of_band);
  for (Index i = 0; i < power.rows(); ++i) {
    const double strongest = power.row(i).maxCoeff();
    for (Index k = 1; k < lines; ++k) {
      const Index from = std::max<Index>(k - kNearby, 1), to = std::min(k + kNearby, lines - 1);
      const double nearby = power.row(i).segment(from, to - from + 1).maxCoeff();
      if (!(nearby > kOutOfBand * strongest)) continue;
      Line& own = drive[static_cast<std::size_t>(k)];
      own = std::max(own, power(i, k) > kEmpty * nearby ? Line::excited : Line::empty);
    }
  }
  // Neighbours of the outermost excited lines have them nearby too.
  const auto excited = [](Line line) { return line == Line::excited; };
  std::fill(drive.begin(), std::find_if(drive.begin(), drive.end(), excited), Line::out_of_band);
  std::fill(drive.rbegin(), std::find_if(drive.rbegin(), drive.rend(), excited), Line::out_of_band);
  return drive;
}

/// Share of the lines in the band, of one parity or (-1) of both, that the drive leaves empty.
double share_of_empty(const Lines& lines, Index parity) {
  double empty = 0, all = 0;
  for (Index k = 1; k < static_cast<Index>(lines.drive.size()); ++k) {
    const Line line = lines.drive[static_cast<std::size_t>(k)];
    if (line == Line::out_of_band || (parity >= 0 && k % 2 != parity)) continue;
    empty += line == Line::empty ? 1 : 0;
    all += 1;
  }
  return all > 0 ? empty / all : 0;
}

/// Error power of each line over the mean of `periods` periods that end with the record.
std::vector<double> line_power(ConstMatrixRef r, Index period, Index periods) {
  const Index lines = period / 2 + 1;
  ComplexMatrix mean = ComplexMatrix::Zero(r.rows(), lines);
  std::vector<ComplexMatrix> each;
  for (Index n = 0; n < periods; ++n) {
    each.push_back(fft(r.middleCols(r.cols() - (periods - n) * period, period)));
    mean += each.back() / static_cast<double>(periods);
  }
  Matrix noise = Matrix::Constant(r.rows(), lines, static_cast<double>(period));  // white, of the floor
  if (periods > 1) {
    noise.setZero();
    for (const ComplexMatrix& own : each) noise += (own - mean).cwiseAbs2() / static_cast<double>(periods - 1);
  }
  std::vector<double> power;
  for (Index k = 0; k < lines; ++k)
    power.push_back(mean.col(k).squaredNorm() - noise.col(k).sum() / static_cast<double>(periods));
  return power;
}

/// What distortions of a line's own parity put on it: the mean of its nearest empty neighbours.
double distortion_at(const Lines& lines, Index k) {
  double sum = 0;
  int found = 0;
  for (const Index step : {Index{-2}, Index{2}})
    for (Index j = k + step; j > 0 && j < static_cast<Index>(lines.drive.size()); j += step)
      if (lines.drive[static_cast<std::size_t>(j)] == Line::empty) {
        sum += lines.power[static_cast<std::size_t>(j)];
        ++found;
        break;
      }
  return found > 0 ? sum / found : 0;
}

}  // namespace

Index find_period(ConstMatrixRef u) {
  const Index N = u.cols();
  Matrix padded = Matrix::Zero(u.rows(), 2 * N);
  padded.leftCols(N) = u.colwise() - u.rowwise().mean();
  for (Index i = 0; i < u.rows(); ++i)
    if (const double size = padded.row(i).norm(); size > 0) padded.row(i) /= size;
  const Matrix power = fft(padded).cwiseAbs2().colwise().sum();
  const Matrix correlation = inverse_fft(power.cast<std::complex<double>>(), 2 * N);
  std::vector<double> energy = {0};  // of the first k samples
  for (Index k = 0; k < N; ++k) energy.push_back(energy.back() + padded.col(k).squaredNorm());
  const auto similarity = [&](Index lag) {
    const double head = energy[static_cast<std::size_t>(N - lag)];
    const double tail = energy.back() - energy[static_cast<std::size_t>(lag)];
    return head > 0 && tail > 0 ? correlation(0, lag) / std::sqrt(head * tail) : 0;
  };
  Index lag = 1;
  while (2 * lag <= N && similarity(lag) > kForgets) ++lag;
  for (; 2 * lag <= N; ++lag)
    if (similarity(lag) > kRepeats && similarity(lag) >= similarity(lag + 1)) return lag;
  return 0;
}

LineSplit line_split(const PlantFit& fit, const std::vector<FitRecord>& records) {
  LineSplit result;
  result.why_not = "the drive is not periodic";
  double linear = 0, odd = 0, even = 0;
  for (std::size_t i = 0; i < records.size(); ++i) {
    const FitRecord& record = records[i];
    const Matrix u = decimate(record.drive, record.ratio).leftCols(record.y.cols());
    const Matrix r = record.weight_std.cwiseInverse().asDiagonal() * fit.error[i];
    Index period = find_period(u), periods = 1;
    if (period > 0) {
      periods = (u.cols() - record.skip) / period;
      if (periods < 1) continue;
      if (periods > 2) --periods;
    }
    Lines lines;
    lines.drive = lines_of_drive(u.rightCols(period > 0 ? period : u.cols()));
    if (period == 0 && share_of_empty(lines, -1) < kEmptyLines) continue;
    if (period == 0) period = u.cols();
    if (share_of_empty(lines, 0) < kDetection) {
      result.why_not = "the drive is periodic but excites every line: an odd multisine would tell odd from even";
      continue;
    }
    lines.power = line_power(r, period, periods);
    result.known = true;
    result.odd_apart = result.odd_apart && share_of_empty(lines, 1) >= kDetection;
    if (periods > result.periods) {
      result.periods = periods;
      result.period_s = static_cast<double>(period * record.ratio) / fit.plant.hold_hz();
    }
    // Parseval: so many squares of r a sample.
    const double scale = 2 * static_cast<double>(periods) / static_cast<double>(period);
    for (Index k = 1; k < static_cast<Index>(lines.power.size()); ++k) {
      const double power = scale * lines.power[static_cast<std::size_t>(k)];
      double& own = k % 2 ? odd : even;
      if (lines.drive[static_cast<std::size_t>(k)] != Line::excited) {
        own += power;
        continue;
      }
      const double distortion = k % 2 && !result.odd_apart ? 0 : scale * distortion_at(lines, k);
      own += distortion;
      linear += power - distortion;
    }
  }
  if (!result.known) return result;
  result.why_not.clear();
  linear = std::max(linear, 0.0);
  odd = std::max(odd, 0.0);
  even = std::max(even, 0.0);
  if (!result.odd_apart) {
    linear += odd;
    odd = 0;
  }
  const double sum = linear + odd + even;
  if (sum > 0) {
    result.linear = linear / sum;
    result.odd = odd / sum;
    result.even = even / sum;
  }
  return result;
}

}  // namespace wheelhop
