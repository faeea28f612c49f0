#include "experiments/look/look.hpp"

#include <fmt/format.h>

#include <cstdio>

#include "core/base/files.hpp"
#include "core/base/status.hpp"
#include "core/data/inspect.hpp"
#include "experiments/run/file_uses.hpp"
#include "experiments/run/standard_output.hpp"

namespace wheelhop {
namespace {

constexpr std::size_t kPlacesShown = 5;  // places that a line names

std::string listed(const std::vector<std::string>& items) {
  std::string text;
  for (std::size_t i = 0; i < std::min(items.size(), kPlacesShown); ++i) text += (i ? ", " : "") + items[i];
  return items.size() > kPlacesShown ? fmt::format("{} and {} more", text, items.size() - kPlacesShown) : text;
}

void print_time(const FileFacts& facts) {
  if (facts.time.empty()) {
    fmt::print("time: no column found that tells it\n");
    return;
  }
  const std::string unit = facts.time_dates     ? "dates and times"
                           : facts.unit_guessed ? fmt::format("taken as {}, the file does not say", facts.time_unit)
                                                : facts.time_unit;
  if (!facts.grid) {
    fmt::print("time: \"{}\" ({}), no uniform grid: {}\n", facts.time, unit, facts.problem);
    return;
  }
  Index lost = 0;
  for (const LostSamples& gap : facts.grid->lost) lost += gap.count;
  fmt::print("time: \"{}\" ({}), {:.9g} Hz, {:.6g} s\n", facts.time, unit, facts.grid->sampling_hz,
             static_cast<double>(facts.samples + lost) / facts.grid->sampling_hz);
  if (facts.grid->scatter > 0)
    fmt::print("  instants lie up to {:.2g} of a period off the grid\n", facts.grid->scatter);
  if (lost > 0) fmt::print("  lost samples: {} ({})\n", lost, listed(facts.lost));
}

void print_columns(const FileFacts& facts) {
  std::size_t width = 6;
  for (const ColumnFacts& column : facts.columns) width = std::max(width, column.name.size());
  fmt::print("\n{:<{}}  {:<8} {:>11} {:>11} {:>11} {:>8} {:>7} {:>8} {:>10}\n", "column", width, "unit", "lowest",
             "highest", "resolution", "missing", "spikes", "clipped", "up to");
  const auto dash = [](bool known, const std::string& text) { return known ? text : std::string("-"); };
  for (const ColumnFacts& column : facts.columns) {
    if (column.missing == facts.samples) {
      fmt::print("{:<{}}  no numbers\n", column.name, width);
      continue;
    }
    fmt::print("{:<{}}  {:<8} {:>11.5g} {:>11.5g} {:>11} {:>8} {:>7} {:>8} {:>10}\n", column.name, width,
               dash(!column.unit.empty(), column.unit), column.low, column.high,
               dash(column.resolution > 0, fmt::format("{:.3g}", column.resolution)), column.missing,
               column.spikes.size(), column.clipped,
               dash(column.spectrum_end_hz > 0, fmt::format("{:.4g} Hz", column.spectrum_end_hz)));
  }
  for (const ColumnFacts& column : facts.columns)
    if (!column.spikes.empty()) {
      std::vector<std::string> places;
      for (const Index k : column.spikes) places.push_back(fmt::format("{}", k));
      fmt::print("spikes in {}: samples {}\n", column.name, listed(places));
    }
  for (const ColumnFacts& column : facts.columns)
    if (column.slow_samples > 1)
      fmt::print("{} was read every {:.3g} samples{}, {} in between\n", column.name, column.slow_samples,
                 facts.grid ? fmt::format(" ({:.4g} Hz)", facts.grid->sampling_hz / column.slow_samples) : "",
                 column.slow_lines ? "with straight lines" : "and repeated");
}

}  // namespace

int run_look(const LookRequest& request) {
  FileUses uses;
  uses.reads("FILE", request.file);
  if (!request.out.empty()) uses.writes("--out", request.out);
  uses.check();
  require_standard_output();
  LayoutHints hints;
  if (!request.layout.empty())
    hints = read_layout_hints(JsonCursor::from(parse_json(request.layout, "--layout"), "--layout"));
  const std::optional<double> rate = request.rate_hz > 0 ? std::optional(request.rate_hz) : std::nullopt;
  const FileFacts facts = inspect_file(request.file, hints, rate);
  fmt::print("{}: {} samples, {} columns\n", request.file.string(), facts.samples,
             facts.columns.size() + (facts.time.empty() ? 0 : 1));
  if (const auto told = facts.text ? layout_told(facts.layout) : std::vector<std::string>{}; !told.empty())
    fmt::print("written with: {}\n", fmt::join(told, "; "));
  print_time(facts);
  print_columns(facts);
  if (!facts.grid && !rate) {
    std::fflush(stdout);
    std::fprintf(stderr, "wheelhop: %s: no rate found%s; say it by --rate HZ\n", request.file.c_str(),
                 facts.time.empty() ? ", no column tells the time" : "");
    return 1;
  }
  const std::filesystem::path beside =
      request.out.empty() ? request.file.filename()
                          : std::filesystem::absolute(request.file)
                                .lexically_proximate(std::filesystem::absolute(request.out).parent_path());
  const Json records = records_that_read(facts, hints, beside.generic_string(), rate);
  fmt::print("\nrecords.json that reads it:\n{}\n", records.dump(2));
  if (!request.out.empty()) {
    write_json(request.out, records);
    fmt::print("\nwritten: {}\n", request.out.string());
  }
  return 0;
}

}  // namespace wheelhop
