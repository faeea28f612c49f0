#include "core/data/slow_channels.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace wheelhop {
namespace {

// Judgements.
constexpr double kEqual = 1e-9;         // of the largest reading, by which equal ones differ in a file
constexpr double kStraight = 1e-3;      // of the RMS step, second difference of what counts as straight
constexpr std::size_t kLeastSeen = 20;  // readings, from which a pattern is believed
constexpr double kRegular = 0.9;        // of the distances between readings, that fit the pattern
constexpr double kOneSize = 0.5;        // of the steps, that a converter makes of one size
constexpr double kSlow = 1.5;           // samples a reading, in the mean
constexpr double kWhole = 0.05;         // of a sample, by which a mean distance counts as a whole one
constexpr std::size_t kAveraged = 200;  // samples over which a response is averaged

/// Mean distance of instants, if they lie as regularly as the readings of a slow channel do; else 0.
double regular_distance(const std::vector<Index>& instants) {
  if (instants.size() < kLeastSeen) return 0;
  std::vector<Index> distances;
  for (std::size_t i = 1; i < instants.size(); ++i) distances.push_back(instants[i] - instants[i - 1]);
  // The median leaves out a stretch at rest, in which no reading differs from the one before.
  std::vector<Index> sorted = distances;
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2), sorted.end());
  const Index usual = sorted[sorted.size() / 2];
  double sum = 0, count = 0;
  for (const Index distance : distances)
    if (distance <= 2 * usual) {
      sum += static_cast<double>(distance);
      ++count;
    }
  const double mean = sum / count;
  if (mean < kSlow) return 0;
  const bool whole = std::abs(mean - std::round(mean)) < kWhole;
  const auto nearest = static_cast<Index>(std::llround(mean));
  const Index jitter = nearest > 2 ? 1 : 0;
  const Index low = whole ? nearest - jitter : static_cast<Index>(std::floor(mean));
  const Index high = whole ? nearest + jitter : static_cast<Index>(std::ceil(mean));
  const auto fits = std::count_if(distances.begin(), distances.end(),
                                  [&](Index distance) { return distance >= low && distance <= high; });
  return static_cast<double>(fits) >= kRegular * static_cast<double>(distances.size()) ? mean : 0;
}

/// True where most steps are of one size.
bool of_one_size(std::vector<double> steps) {
  std::sort(steps.begin(), steps.end());
  std::size_t most = 0, run = 0;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    run = i > 0 && steps[i] - steps[i - 1] <= 1e-6 * steps[i] ? run + 1 : 1;
    most = std::max(most, run);
  }
  return static_cast<double>(most) > kOneSize * static_cast<double>(steps.size());
}

SlowChannel repeated(ConstVectorRef y) {
  const double equal = kEqual * y.cwiseAbs().maxCoeff();
  std::vector<Index> instants;
  std::vector<double> steps;
  for (Index k = 1; k < y.size(); ++k)
    if (const double step = std::abs(y(k) - y(k - 1)); step > equal) {
      instants.push_back(k);
      steps.push_back(step);
    }
  SlowChannel slow;
  const double distance = regular_distance(instants);
  if (distance == 0 || of_one_size(std::move(steps))) return slow;
  slow.samples = distance;
  slow.before.resize(static_cast<std::size_t>(y.size()));
  Index last = 0;
  auto next = instants.begin();
  for (Index k = 0; k < y.size(); ++k) {
    if (next != instants.end() && *next == k) {
      last = k;
      ++next;
    }
    slow.before[static_cast<std::size_t>(k)] = last;
  }
  slow.after = slow.before;
  slow.share.assign(slow.before.size(), 0);
  return slow;
}

SlowChannel in_lines(ConstVectorRef y) {
  SlowChannel slow;
  const Index N = y.size();
  if (N < 3) return slow;
  const Vector steps = y.tail(N - 1) - y.head(N - 1);
  const double straight = kStraight * steps.norm() / std::sqrt(static_cast<double>(N - 1));
  std::vector<Index> knots;
  for (Index k = 1; k + 1 < N; ++k)
    if (std::abs(steps(k) - steps(k - 1)) > straight) knots.push_back(k);
  const double distance = regular_distance(knots);
  if (distance < 2) return slow;
  slow.samples = distance;
  slow.lines = true;
  knots.insert(knots.begin(), 0);
  knots.push_back(N - 1);
  std::size_t piece = 0;
  for (Index k = 0; k < N; ++k) {
    while (piece + 2 < knots.size() && knots[piece + 1] <= k) ++piece;
    const Index before = knots[piece], after = knots[piece + 1];
    slow.before.push_back(before);
    slow.after.push_back(after);
    slow.share.push_back(static_cast<double>(k - before) / static_cast<double>(after - before));
  }
  return slow;
}

}  // namespace

std::vector<SlowChannel> slow_channels(ConstMatrixRef y) {
  std::vector<SlowChannel> list;
  bool any = false;
  for (Index i = 0; i < y.rows(); ++i) {
    const Vector row = y.row(i).transpose();
    SlowChannel slow = repeated(row);
    if (slow.before.empty()) slow = in_lines(row);
    any = any || !slow.before.empty();
    list.push_back(std::move(slow));
  }
  if (!any) list.clear();
  return list;
}

void find_slow_channels(RecordSet& set) {
  for (Record& record : set.records) record.signal.slow = slow_channels(record.signal.y);
}

std::vector<SlowOutput> slow_outputs(const RecordSet& set) {
  std::vector<SlowOutput> list;
  for (const Record& record : set.records)
    for (std::size_t i = 0; i < record.signal.slow.size(); ++i)
      if (const SlowChannel& own = record.signal.slow[i]; !own.before.empty())
        list.push_back({record.file, record.signal.outputs[i].name, own.samples, set.sampling_hz / own.samples,
                        own.lines ? "lines" : "repeated"});
  return list;
}

void as_logged(const std::vector<SlowChannel>& slow, Matrix& y) {
  for (std::size_t i = 0; i < slow.size(); ++i) {
    if (slow[i].before.empty()) continue;
    const auto row = static_cast<Index>(i);
    const Index last = std::min(y.cols(), static_cast<Index>(slow[i].before.size())) - 1;
    const Vector read = y.row(row).transpose();
    for (Index k = 0; k <= last; ++k) {
      const auto at = static_cast<std::size_t>(k);
      y(row, k) = (1 - slow[i].share[at]) * read(slow[i].before[at]) +
                  slow[i].share[at] * read(std::min(slow[i].after[at], last));
    }
  }
}

std::vector<SlowChannel> part_of(const std::vector<SlowChannel>& slow, Index begin, Index count) {
  std::vector<SlowChannel> part;
  for (const SlowChannel& whole : slow) {
    SlowChannel own;
    own.samples = whole.samples;
    own.lines = whole.lines;
    for (Index k = begin; k < begin + count && !whole.before.empty(); ++k) {
      const auto at = static_cast<std::size_t>(k);
      // What was read before the part begins is not known there: the first sample stands for it.
      own.before.push_back(std::max(whole.before[at] - begin, Index{0}));
      own.after.push_back(std::clamp(whole.after[at] - begin, Index{0}, count - 1));
      own.share.push_back(whole.share[at]);
    }
    part.push_back(std::move(own));
  }
  return part;
}

Vector readings_of(const SlowChannel& slow, ConstVectorRef row) {
  if (slow.before.empty()) return row;
  std::vector<double> values;
  for (Index k = 0; k < row.size(); ++k)
    if (slow.before[static_cast<std::size_t>(k)] == k) values.push_back(row(k));
  return Eigen::Map<const Vector>(values.data(), static_cast<Index>(values.size()));
}

std::complex<double> response_of(const SlowChannel& slow, double cycles) {
  if (slow.before.empty()) return 1;
  const auto turned = [&](Index by) {
    return std::polar(1.0, 2 * std::numbers::pi * cycles * static_cast<double>(by));
  };
  std::complex<double> sum = 0;
  const std::size_t count = std::min(slow.before.size(), kAveraged);
  for (std::size_t at = 0; at < count; ++at) {
    const auto k = static_cast<Index>(at);
    sum += (1 - slow.share[at]) * turned(slow.before[at] - k) + slow.share[at] * turned(slow.after[at] - k);
  }
  return sum / static_cast<double>(count);
}

}  // namespace wheelhop
