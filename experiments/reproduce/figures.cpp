#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/data/metrics.hpp"
#include "experiments/reproduce/table.hpp"

namespace wheelhop {
namespace {

// The paper's second: the linear model fails in its first 0.4 s and does well in its last 0.3 s.
constexpr double length_s = 1, fails_s = 0.4, does_well_s = 0.3, step_s = 0.05;
// Stretches in which the car hardly moves say nothing: every signal must reach half of its RMS in both.
constexpr double least_level = 0.5;
// Half of the signal missed is failure enough; below that the end of the second decides.
constexpr double fails_vaf = 50;

}  // namespace

Segment find_segment(const std::array<Matrix, 3>& lines, double sample_time_s) {
  const auto samples = [&](double seconds) { return static_cast<Index>(std::llround(seconds / sample_time_s)); };
  const Index length = samples(length_s), start = samples(fails_s), end = samples(does_well_s);
  const Index step = std::max<Index>(1, samples(step_s)), total = lines[0].cols();
  Segment best;
  if (start < 1 || end < 1) return best;
  std::array<double, 3> level{};
  for (std::size_t s = 0; s < 3; ++s) level[s] = rms(lines[s].topRows(1))(0);
  for (Index first = 0; first + length <= total; first += step) {
    double fails = fails_vaf, does_well = 100;  // all three figures must show both
    bool moves = true;
    for (std::size_t s = 0; s < 3; ++s) {
      const auto part = [&](Index from, Index count) {
        const Matrix both = lines[s].block(0, from, 2, count);
        moves = moves && rms(both.topRows(1))(0) >= least_level * level[s];
        return vaf_percent(both.topRows(1), both.bottomRows(1))(0);
      };
      fails = std::max(fails, part(first, start));
      does_well = std::min(does_well, part(first + length - end, end));
    }
    const double contrast = does_well - fails;
    if (moves && contrast > best.contrast) {
      best.contrast = contrast;
      best.first = first;
    }
  }
  if (best.contrast > 0)
    for (std::size_t s = 0; s < 3; ++s) best.lines[s] = lines[s].middleCols(best.first, length);
  return best;
}

Json figures_json(const ReproduceConfig& config, const std::vector<RealisationRow>& rows) {
  const RealisationRow* chosen = nullptr;
  for (const RealisationRow& row : rows)
    if (row.segment.contrast > 0 && (!chosen || row.segment.contrast > chosen->segment.contrast)) chosen = &row;
  if (!chosen) return {};
  const double T = 1 / config.data.sampling_hz;
  // Decimal fractions of a second read better than their binary neighbours.
  const auto seconds = [](double t) { return std::round(t * 1e6) / 1e6; };
  const double from = seconds(static_cast<double>(chosen->segment.first) * T), to = seconds(from + length_s);
  Json time = Json::array();
  for (Index k = 0; k < chosen->segment.lines[0].cols(); ++k)
    time.push_back(seconds(from + static_cast<double>(k) * T));
  Json signals = Json::array();
  for (std::size_t s = 0; s < 3; ++s) {
    const PaperSignal& paper = kPaperSignals[s];
    Json signal = {{"signal", paper.name},
                   {"figure", paper.figure},
                   {"title", paper.title},
                   {"unit", config.plant.sensors[static_cast<std::size_t>(config.car->sensors[s])].unit}};
    const char* names[] = {"measured", "linear", "nonlinear", "refined"};
    for (Index line = 0; line < 4; ++line) {
      const Vector values = chosen->segment.lines[s].row(line);
      signal[names[line]] = std::vector<double>(values.begin(), values.end());
    }
    for (const Column column : {Column::linear, Column::nonlinear, Column::refined}) {
      const auto c = static_cast<std::size_t>(column);
      signal["vaf_percent"][kColumnNames[c]] = chosen->columns[c].vaf_percent[s];
    }
    signals.push_back(std::move(signal));
  }
  return {{"schema", "wheelhop.figures/1"},
          {"realisation", chosen->realisation},
          {"from_s", from},
          {"to_s", to},
          {"fails_s", {from, seconds(from + fails_s)}},
          {"does_well_s", {seconds(to - does_well_s), to}},
          {"time_s", std::move(time)},
          {"signals", std::move(signals)}};
}

}  // namespace wheelhop
