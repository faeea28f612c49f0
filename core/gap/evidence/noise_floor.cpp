#include "core/gap/evidence/noise_floor.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/base/status.hpp"
#include "core/data/metrics.hpp"
#include "core/data/slow_channels.hpp"
#include "core/data/spectra.hpp"
#include "core/plant/dataset.hpp"

namespace wheelhop {
namespace {

constexpr double kMeetings = 4;         // readings a step of the lattice
constexpr double kOnLattice = 1e-3;     // of a step, by which a reading may lie beside it: digits of a file
constexpr Index kColourBands = 24;      // in which the density of the noise is looked at
constexpr Index kErrorBlocks = 20;      // of time, whose scatter tells the error of the noise power
constexpr double kEstimateError = 0.1;  // of the power that the quiet end tells, for what is not white in it
// Of the largest drive of a unit, RMS over RMS; judgements:
constexpr double kSameDrive = 0.05;   // repeats that differ by more are not averaged
constexpr double kLikeRepeat = 0.15;  // records that differ by less are taken for repeats although no file says so
constexpr double kOtherDrive = 0.5;   // what differs by more is no repeat whatever the file says

/// Largest difference between the inputs of two records of one length, as RMS over the RMS of the largest drive of the
/// same unit, since an actuator at rest shows its noise alone; and the input it is of.
struct Difference {
  double share = 0;
  std::size_t input = 0;
};

Difference difference_of(const Signal& first, const Signal& other) {
  Difference largest;
  const Vector level = rms(first.u), difference = rms(other.u - first.u);
  for (Index i = 0; i < level.size(); ++i) {
    const auto input = static_cast<std::size_t>(i);
    double size = 0;
    for (Index j = 0; j < level.size(); ++j)
      if (first.inputs[static_cast<std::size_t>(j)].unit == first.inputs[input].unit) size = std::max(size, level(j));
    if (size == 0) size = difference(i);
    const double share = size > 0 ? difference(i) / size : 0;
    if (share > largest.share) largest = {share, input};
  }
  return largest;
}

/// Records in groups, in the order of the file. @param same whether a record belongs to the group of another one
template <class Same>
std::vector<Repeats> grouped(const RecordSet& set, Same same) {
  std::vector<Repeats> groups;
  for (const Record& record : set.records) {
    const auto found =
        std::find_if(groups.begin(), groups.end(), [&](const Repeats& group) { return same(*group.front(), record); });
    if (found == groups.end())
      groups.push_back({&record});
    else
      found->push_back(&record);
  }
  return groups;
}

bool said_to_repeat(const Record& first, const Record& other) {
  return !first.repeat_of.empty() && first.repeat_of == other.repeat_of;
}

bool looks_repeated(const Record& first, const Record& other) {
  const Signal &one = first.signal, &two = other.signal;
  if (one.samples() != two.samples() || one.u.isZero(0) || (one.y - two.y).isZero(0)) return false;
  return difference_of(one, two).share <= kLikeRepeat;
}

/// Records that are averaged: said to be repeats in one role, whose drives are the same.
std::vector<Repeats> averaged(const RecordSet& set) {
  return grouped(set, [](const Record& first, const Record& other) {
    return said_to_repeat(first, other) && first.role == other.role && first.start == other.start &&
           first.signal.slow == other.signal.slow && difference_of(first.signal, other.signal).share <= kSameDrive;
  });
}

/// Mean over the repeats of `of`, u or y.
Matrix mean_of(const Repeats& group, Matrix Signal::*of) {
  Matrix mean = group.front()->signal.*of;
  for (std::size_t r = 1; r < group.size(); ++r) mean += group[r]->signal.*of;
  return mean / static_cast<double>(group.size());
}

/// First sample that every repeat scores.
Index skip_of(const Repeats& group) {
  Index skip = 0;
  for (const Record* record : group) skip = std::max(skip, record->signal.skip);
  return skip;
}

/// UserError if records that are said to be repeats cannot be.
void check_repeats(const RecordSet& set) {
  for (const Repeats& group : grouped(set, said_to_repeat)) {
    const Record& first = *group.front();
    for (const Record* other : group) {
      if (other->signal.samples() != first.signal.samples())
        throw UserError(fmt::format("{}: expected {} samples as in {}, whose drive \"{}\" it repeats, found {}",
                                    other->file, first.signal.samples(), first.file, first.repeat_of,
                                    other->signal.samples()));
      const Difference apart = difference_of(first.signal, other->signal);
      if (apart.share > kOtherDrive)
        throw UserError(fmt::format(
            "{}: input \"{}\" differs from that of {} by {:.1f} % (RMS): they are not repeats of one drive \"{}\"",
            other->file, first.signal.inputs[apart.input].name, first.file, 100 * apart.share, first.repeat_of));
    }
  }
}

/// Lines of a spectrum in the upper fifth of the band.
Index quiet_lines(Index lines) { return std::max<Index>(lines / 5, 1); }

/// White level that the median line of the upper fifth of the band tells.
Vector quiet_end(ConstMatrixRef y) {
  const ComplexMatrix spectrum = hann_spectrum(y);
  const Index lines = spectrum.cols(), first = lines - quiet_lines(lines);
  Vector std(y.rows());
  for (Index i = 0; i < y.rows(); ++i) {
    std::vector<double> power;
    for (Index k = first; k < lines; ++k) power.push_back(std::norm(spectrum(i, k)));
    const auto middle = power.begin() + static_cast<std::ptrdiff_t>(power.size() / 2);
    std::nth_element(power.begin(), middle, power.end());
    // White noise of variance s^2 under this window: |X|^2 is exponential with mean 6 s^2 / N, median ln 2 of it.
    std(i) = std::sqrt(*middle / std::log(2.0) * static_cast<double>(y.cols()) / 6);
  }
  return std;
}

/// Standard error of the mean of |noise / std|^2 over channels and groups.
double error_of_power(const std::vector<Repeats>& groups, ConstVectorRef std) {
  std::vector<double> powers;
  for (const Repeats& group : groups) {
    const std::vector<Matrix> noise = noise_of_repeats(group);
    const Index block = noise.front().cols() / kErrorBlocks;
    if (block == 0) continue;
    const double degrees = static_cast<double>((static_cast<Index>(group.size()) - 1) * block * std.size());
    for (Index b = 0; b < kErrorBlocks; ++b) {
      double power = 0;
      for (const Matrix& own : noise)
        power += (own.middleCols(b * block, block).array().colwise() / std.array()).square().sum();
      powers.push_back(power / degrees);
    }
  }
  if (powers.size() < 2) return kEstimateError;
  const Eigen::Map<const Vector> all(powers.data(), static_cast<Index>(powers.size()));
  const double count = static_cast<double>(all.size());
  return std::sqrt((all.array() - all.mean()).square().sum() / (count * (count - 1)));
}

}  // namespace

std::string to_string(FloorSource source) {
  switch (source) {
    case FloorSource::repeats: return "repeats of one drive";
    case FloorSource::noise_std: return "noise_std of the record set";
    default: return "estimated from the quiet end of the spectrum";
  }
}

std::vector<Repeats> repeats_of(const RecordSet& set) {
  check_repeats(set);
  const bool said = std::any_of(set.records.begin(), set.records.end(),
                                [](const Record& record) { return !record.repeat_of.empty(); });
  std::vector<Repeats> groups = grouped(set, said ? said_to_repeat : looks_repeated);
  std::erase_if(groups, [](const Repeats& group) { return group.size() < 2; });
  return groups;
}

std::vector<Matrix> noise_of_repeats(const Repeats& group) {
  const Matrix mean = mean_of(group, &Signal::y);
  const Index kept = mean.cols() - skip_of(group);
  std::vector<Matrix> noise;
  for (const Record* record : group) noise.push_back((record->signal.y - mean).rightCols(kept));
  return noise;
}

std::vector<Measured> merge_repeats(const RecordSet& set) {
  check_repeats(set);
  std::vector<Measured> merged;
  for (const Repeats& group : averaged(set)) {
    const Record& first = *group.front();
    Measured measured{group.size() > 1 ? first.repeat_of : first.file, first.role, first.signal,
                      static_cast<Index>(group.size()), Vector(first.signal.y.rows())};
    measured.signal.u = mean_of(group, &Signal::u);
    measured.signal.y = mean_of(group, &Signal::y);
    measured.signal.skip = skip_of(group);
    for (Index i = 0; i < measured.quantum.size(); ++i) measured.quantum(i) = lattice_step(first.signal.y.row(i));
    measured.start = first.start;
    measured.continues = first.continues;
    merged.push_back(std::move(measured));
  }
  return merged;
}

RecordSet prediction_errors(const Plant& plant, const RecordSet& set) {
  bool differ = false;
  for (const Repeats& group : repeats_of(set))
    for (const Record* record : group)
      differ = differ || !(record->signal.u - group.front()->signal.u).isZero(0) ||
               record->signal.slow != group.front()->signal.slow;
  if (!differ) return set;
  RecordSet errors = set;
  for (Record& record : errors.records) {
    GeneratedRecord made = simulate_record(plant, record.signal);
    if (made.status != Status::ok) return set;
    as_logged(record.signal.slow, made.signal.y);
    record.signal.y -= made.signal.y;
  }
  return errors;
}

namespace {

/// quiet_end() of a record's last samples, of a slow channel over those that were read.
Vector quiet_end_of(const Signal& signal, Index kept) {
  Vector level = quiet_end(signal.y.rightCols(kept));
  for (std::size_t i = 0; i < signal.slow.size(); ++i) {
    const auto row = static_cast<Index>(i);
    const Vector read = readings_of(signal.slow[i], signal.y.row(row).transpose());
    if (read.size() < signal.y.cols() && read.size() > 1) level(row) = quiet_end(read.transpose())(0);
  }
  return level;
}

/// Samples a reading of the slowest channel; 1 where all are read at every sample.
double slowest(const RecordSet& set) {
  double most = 1;
  for (const Record& record : set.records)
    for (const SlowChannel& channel : record.signal.slow) most = std::max(most, channel.samples);
  return most;
}

}  // namespace

NoiseFloor noise_floor(const RecordSet& set) {
  const std::vector<Channel>& outputs = set.records.front().signal.outputs;
  const Index p = static_cast<Index>(outputs.size());
  NoiseFloor floor;
  Vector within = Vector::Zero(p);
  const std::vector<Repeats> groups = repeats_of(set);
  for (const Repeats& group : groups) {
    const std::vector<Matrix> noise = noise_of_repeats(group);
    for (const Matrix& own : noise) {
      within += own.rowwise().squaredNorm();
      floor.colour = std::max(floor.colour, colour_of(own));
    }
    floor.degrees += static_cast<Index>(group.size() - 1) * noise.front().cols();
    std::vector<std::string> files;
    for (const Record* record : group) files.push_back(record->file);
    floor.repeats.push_back(std::move(files));
  }
  if (floor.degrees > 0) {
    floor.source = FloorSource::repeats;
    floor.std = (within / static_cast<double>(floor.degrees)).cwiseSqrt();
    // Records that only look like repeats may tell less than what was given.
    for (Index i = 0; i < p && groups.front().front()->repeat_of.empty(); ++i)
      if (const auto given = set.noise_std.find(outputs[static_cast<std::size_t>(i)].name);
          given != set.noise_std.end())
        floor.std(i) = std::max(floor.std(i), given->second);
  } else if (!set.noise_std.empty()) {
    floor.source = FloorSource::noise_std;
    floor.std.resize(p);
    for (Index i = 0; i < p; ++i) {
      const auto found = set.noise_std.find(outputs[static_cast<std::size_t>(i)].name);
      if (found == set.noise_std.end())
        throw UserError(fmt::format("noise_std: expected a value for every output, found none for \"{}\"",
                                    outputs[static_cast<std::size_t>(i)].name));
      floor.std(i) = found->second;
    }
  } else {
    Vector power = Vector::Zero(p);
    double lines = 0;
    for (const Record& record : set.records) {
      const Index kept = record.signal.samples() - record.signal.skip;
      lines += static_cast<double>(quiet_lines(kept / 2 + 1) * p);
      power += static_cast<double>(kept) * quiet_end_of(record.signal, kept).cwiseAbs2();
      floor.degrees += kept;
    }
    floor.std = (power / static_cast<double>(floor.degrees)).cwiseSqrt();
    // The median of n exponential lines scatters by 1 / (ln 2 sqrt(n)) of itself.
    floor.power_error = std::hypot(kEstimateError, 1 / (std::log(2.0) * std::sqrt(lines)));
  }
  for (Index i = 0; i < p; ++i)
    if (!(floor.std(i) > 0) || !std::isfinite(floor.std(i)))
      throw UserError(
          fmt::format("output \"{}\": no noise floor can be told ({}): the channel is constant, or the same "
                      "in every repeat to the last digit; give its noise_std in the record set",
                      outputs[static_cast<std::size_t>(i)].name, to_string(floor.source)));
  if (floor.source == FloorSource::repeats)
    floor.power_error = error_of_power(groups, floor.std);
  else
    floor.colour = slowest(set);  // the noise of a reading is repeated with it
  return floor;
}

double colour_of(ConstMatrixRef noise) {
  const ComplexMatrix spectrum = hann_spectrum(noise);
  const Index width = spectrum.cols() / kColourBands;
  double largest = 1;
  if (width < 8) return largest;
  for (Index i = 0; i < spectrum.rows(); ++i) {
    const double mean = spectrum.row(i).squaredNorm() / static_cast<double>(spectrum.cols());
    for (Index band = 0; band < kColourBands && mean > 0; ++band)
      largest = std::max(
          largest, spectrum.row(i).segment(band * width, width).squaredNorm() / (static_cast<double>(width) * mean));
  }
  return largest;
}

double lattice_step(ConstVectorRef values) {
  std::vector<double> sorted(values.begin(), values.end());
  std::sort(sorted.begin(), sorted.end());
  if (sorted.empty()) return 0;
  // Readings that were equal are equal in a file up to their last digits.
  const double equal = 1e-9 * std::max(std::abs(sorted.front()), std::abs(sorted.back()));
  std::vector<double> levels = {sorted.front()};
  double step = std::numeric_limits<double>::infinity();
  for (const double value : sorted) {
    if (value - levels.back() <= equal) continue;
    step = std::min(step, value - levels.back());
    levels.push_back(value);
  }
  if (levels.size() < 3 || static_cast<double>(sorted.size()) < kMeetings * static_cast<double>(levels.size()))
    return 0;
  // The smallest difference knows few digits of the step; counted out over a growing range it gets more.
  for (const double level : levels) {
    const double count = std::round((level - levels.front()) / step);
    if (count > 0) step = (level - levels.front()) / count;
  }
  for (const double level : levels) {
    const double place = (level - levels.front()) / step;
    if (std::abs(place - std::round(place)) > kOnLattice + 1e-6 * place) return 0;
  }
  return step;
}

}  // namespace wheelhop
