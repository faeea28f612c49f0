#include "core/data/inspect.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>

#include "core/base/status.hpp"
#include "core/data/csv.hpp"
#include "core/data/lost_samples.hpp"
#include "core/data/mat.hpp"
#include "core/data/reading.hpp"
#include "core/data/slow_channels.hpp"
#include "core/data/spectra.hpp"
#include "core/data/spikes.hpp"
#include "core/data/units.hpp"

namespace wheelhop {
namespace fs = std::filesystem;
namespace {

// Judgements: signals of vehicles end where a thousandth of their power is left; loggers of vibrations are no slower
// than 10 Hz.
constexpr double kPowerBelow = 0.999, kSlowest_hz = 10;
constexpr Index kClippedRun = 3;

Index clipped_in(ConstVectorRef x, double low, double high) {
  Index clipped = 0, run = 0;
  if (low == high) return 0;
  for (Index k = 0; k < x.size(); ++k) {
    const bool at_end = x(k) == low || x(k) == high;
    run = at_end ? (run > 0 && x(k) == x(k - 1) ? run + 1 : 1) : 0;
    if (run == kClippedRun) clipped += kClippedRun;
    if (run > kClippedRun) ++clipped;
  }
  return clipped;
}

double resolution_of(ConstVectorRef x) {
  std::vector<double> values(x.data(), x.data() + x.size());
  std::sort(values.begin(), values.end());
  Index distinct = 1;
  double least = 0;
  for (std::size_t i = 1; i < values.size(); ++i) {
    const double distance = values[i] - values[i - 1];
    if (!(distance > 0)) continue;
    ++distinct;
    least = least > 0 ? std::min(least, distance) : distance;
  }
  return 2 * distinct <= x.size() ? least : 0;
}

double spectrum_end(ConstVectorRef x, double sample_time_s) {
  const ComplexMatrix spectrum = hann_spectrum(x.transpose());
  const Vector power = spectrum.row(0).cwiseAbs2().transpose();
  const Vector line_hz = fft_frequencies_hz(x.size(), sample_time_s);
  const double total = power.sum();
  double below = 0;
  for (Index k = 0; total > 0 && k < power.size(); ++k)
    if ((below += power(k)) >= kPowerBelow * total) return line_hz(k);
  return 0;
}

/// All columns of a file, as they stand in it.
struct Whole {
  TextTable table;
  std::vector<std::string> names, units;
};

Whole read_whole(const fs::path& file, const LayoutHints& hints, FileFacts& facts) {
  Whole whole;
  facts.text = !is_mat_name(file);
  if (!facts.text) {
    Table table = read_mat_vectors(file);
    whole.names = std::move(table.names);
    whole.table.columns = std::move(table.columns);
    whole.units.resize(whole.names.size());
    return whole;
  }
  const std::string text = read_text(file);
  facts.layout = find_layout(text, hints, {}, file.string());
  std::vector<WantedColumn> all;
  for (std::size_t j = 0; j < facts.layout.names.size(); ++j) {
    all.push_back({j, facts.layout.instants[j]});
    whole.names.push_back(facts.layout.names[j]);
    whole.units.push_back(column_unit(facts.layout, j, ""));
  }
  whole.table = read_text_table(text, facts.layout, all);
  return whole;
}

/// Column of time: by its name, else by holding dates; -1 if there is none.
Index time_column(const Whole& whole, const TextLayout& layout) {
  for (const char* begin : {"t", "time", "zeit", "date"})
    for (std::size_t j = 0; j < whole.names.size(); ++j) {
      std::string base = split_name(whole.names[j]).base;
      for (char& c : base) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
      if (begin == std::string("t") ? base == begin : base.starts_with(begin)) return static_cast<Index>(j);
    }
  const auto named = std::find_if(whole.names.begin(), whole.names.end(), is_time_name);
  if (named != whole.names.end()) return named - whole.names.begin();
  const auto dated = std::find(layout.instants.begin(), layout.instants.end(), true);
  return dated == layout.instants.end() ? -1 : dated - layout.instants.begin();
}

void find_grid(const Whole& whole, Index column, const fs::path& file, std::optional<double> sampling_hz,
               FileFacts& facts) {
  const auto j = static_cast<std::size_t>(column);
  facts.time = whole.names[j];
  facts.time_dates = j < facts.layout.instants.size() && facts.layout.instants[j];
  facts.time_unit = facts.time_dates ? "" : whole.units[j];
  const auto told = find_unit(facts.time_unit);
  facts.unit_guessed = !facts.time_dates && (!told || told->powers != find_unit("s")->powers);
  const Vector t = whole.table.columns.row(column).transpose();
  const auto place = [&](Index k) {
    return facts.text ? fmt::format("line {}", whole.table.line_of(k)) : fmt::format("sample {}", k);
  };
  const auto missing = std::find_if(t.begin(), t.end(), [](double value) { return !std::isfinite(value); });
  if (missing != t.end() || t.size() < 2) {
    facts.problem =
        t.size() < 2 ? "a single sample" : fmt::format("no time at {}", place(static_cast<Index>(missing - t.begin())));
    return;
  }
  std::vector<std::string> units = {"s", "ms", "us"};
  if (!facts.unit_guessed) units = {facts.time_dates ? "s" : facts.time_unit};
  for (const std::string& unit : units) try {
      const double unit_s = find_unit(unit)->factor;
      const TimeRequest usual{sampling_hz, unit_s, {}, true, facts.time, file.string(), place};
      try {
        facts.grid = fit_time_grid(t, usual);
      } catch (const UserError&) {
        TimeRequest wide = usual;
        wide.scatter = most_scatter;
        facts.grid = fit_time_grid(t, wide);
        facts.scatter_asked = true;
      }
      if (!facts.time_dates) facts.time_unit = unit;
      if (!facts.unit_guessed || sampling_hz || facts.grid->sampling_hz >= kSlowest_hz) break;
    } catch (const UserError& error) {
      facts.problem = error.what();
    }
  if (!facts.grid) return;
  facts.problem.clear();
  for (const LostSamples& gap : facts.grid->lost)
    facts.lost.push_back(fmt::format("{} before {}", gap.count, place(gap.before)));
}

}  // namespace

ColumnFacts column_facts(ConstVectorRef x, double sample_time_s) {
  ColumnFacts facts;
  std::vector<double> finite;
  for (const double value : x)
    if (std::isfinite(value)) finite.push_back(value);
  facts.missing = x.size() - static_cast<Index>(finite.size());
  if (finite.empty()) return facts;
  const Eigen::Map<const Vector> held(finite.data(), static_cast<Index>(finite.size()));
  facts.low = held.minCoeff();
  facts.high = held.maxCoeff();
  facts.resolution = resolution_of(held);
  facts.clipped = clipped_in(held, facts.low, facts.high);
  if (facts.missing > 0) return facts;
  for (const SpikeAt& spike : find_spikes(x.transpose())) facts.spikes.push_back(spike.sample);
  for (const SlowChannel& slow : slow_channels(x.transpose())) {
    facts.slow_samples = slow.samples;
    facts.slow_lines = slow.lines;
  }
  if (sample_time_s > 0 && x.size() > 3) facts.spectrum_end_hz = spectrum_end(x, sample_time_s);
  return facts;
}

FileFacts inspect_file(const fs::path& file, const LayoutHints& hints, std::optional<double> sampling_hz) {
  FileFacts facts;
  const Whole whole = read_whole(file, hints, facts);
  facts.samples = whole.table.columns.cols();
  const Index time = time_column(whole, facts.layout);
  if (time >= 0) find_grid(whole, time, file, sampling_hz, facts);
  const double hz = facts.grid ? facts.grid->sampling_hz : sampling_hz.value_or(0);
  const bool even = !facts.grid || facts.grid->lost.empty();
  for (Index i = 0; i < whole.table.columns.rows(); ++i) {
    if (i == time) continue;
    const auto j = static_cast<std::size_t>(i);
    ColumnFacts own = column_facts(whole.table.columns.row(i).transpose(), hz > 0 && even ? 1 / hz : 0);
    own.name = whole.names[j];
    own.unit = whole.units[j];
    own.number = i + 1;
    facts.columns.push_back(std::move(own));
  }
  return facts;
}

Json records_that_read(const FileFacts& facts, const LayoutHints& hints, const std::string& name,
                       std::optional<double> sampling_hz) {
  if (!facts.grid && !sampling_hz)
    throw UserError(fmt::format("{}: no rate found{}; say it by --rate HZ", name,
                                facts.problem.empty() ? ": no column tells the time" : ": " + facts.problem));
  Json out = Json::object();
  if (!facts.grid) {
    out["time"] = {{"rate_hz", *sampling_hz}};
  } else {
    if (sampling_hz || facts.unit_guessed) out["sampling_hz"] = facts.grid->sampling_hz;
    Json time = Json::object();
    if (facts.time != "t") time["column"] = facts.time;
    if (facts.unit_guessed && facts.time_unit != "s") time["unit"] = facts.time_unit;
    if (facts.scatter_asked) time["scatter"] = std::ceil(100 * facts.grid->scatter) / 100;
    if (!time.empty()) out["time"] = std::move(time);
  }
  Json columns = Json::object();
  for (const ColumnFacts& column : facts.columns) {
    const auto same = [&](const ColumnFacts& other) { return other.name == column.name; };
    if (column.missing == facts.samples) continue;
    if (facts.layout.header_line == 0 || column.name.empty() ||
        std::count_if(facts.columns.begin(), facts.columns.end(), same) > 1)
      columns[fmt::format("channel_{}", column.number)] = column.number;
  }
  if (facts.text && !columns.empty()) out["columns"] = std::move(columns);
  Json format = facts.text ? layout_json(facts.layout) : Json::object();
  if (hints.comment) format["comment"] = *hints.comment;
  if (!format.empty()) out["format"] = std::move(format);
  if (facts.grid && !facts.grid->lost.empty()) {
    const bool short_gaps = std::all_of(facts.grid->lost.begin(), facts.grid->lost.end(),
                                        [](const LostSamples& gap) { return gap.count <= longest_bridge; });
    out["lost_samples"] = short_gaps ? "bridge" : "cut";
  }
  out["records"] = Json::array({{{"file", name}, {"role", "estimation"}}});
  return out;
}

}  // namespace wheelhop
