#include "core/data/reading.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <new>

#include "core/base/files.hpp"
#include "core/base/status.hpp"
#include "core/data/csv.hpp"
#include "core/data/lost_samples.hpp"
#include "core/data/mat.hpp"
#include "core/data/time_axis.hpp"
#include "core/data/units.hpp"

namespace wheelhop {
namespace fs = std::filesystem;
namespace {

std::string lower_case(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

void read_place(const JsonCursor& cursor, std::string& name, Index& number) {
  if (cursor.is_number()) {
    number = cursor.integer(1, 100000);
  } else if (cursor.is_string() && !cursor.string().empty()) {
    name = cursor.string();
  } else {
    cursor.fail("the name of a column, or its number from 1");
  }
}

std::string read_unit(const JsonCursor& cursor, const char* example) {
  const std::string unit = cursor.string();
  if (!find_unit(unit)) cursor.fail(fmt::format("a unit that is known ({}), as \"{}\"", known_units(), example));
  return unit;
}

ColumnMap read_column_map(const std::string& channel, const JsonCursor& cursor) {
  ColumnMap map;
  map.channel = channel;
  map.where = cursor.where();
  if (!cursor.is_object()) {
    read_place(cursor, map.column, map.number);
    return map;
  }
  if (const auto value = cursor.find("value")) {
    map.value = value->number();
    cursor.done();  // nothing is read that a unit or a scale could belong to
    return map;
  }
  if (const auto column = cursor.find("column")) read_place(*column, map.column, map.number);
  if (const auto unit = cursor.find("unit")) map.unit = read_unit(*unit, "mm");
  map.scale = cursor.number("scale", 1);
  if (map.scale == 0) cursor.at("scale").fail("a number other than 0");
  map.offset = cursor.number("offset", 0);
  if (const auto sensitivity = cursor.find("sensitivity")) {
    map.sensitivity = sensitivity->string();
    if (!find_sensitivity(map.sensitivity)) sensitivity->fail("a number > 0 and a unit, as \"100 mV/g\"");
  }
  cursor.done();
  return map;
}

TimeMap read_time_map(const JsonCursor& cursor) {
  TimeMap map;
  map.said = true;
  if (!cursor.is_object()) {
    read_place(cursor, map.column, map.number);
    return map;
  }
  const auto column = cursor.find("column");
  if (column) read_place(*column, map.column, map.number);
  if (const auto unit = cursor.find("unit")) {
    map.unit = read_unit(*unit, "ms");
    if (find_unit(map.unit)->powers != find_unit("s")->powers) unit->fail("a unit of time, as \"ms\"");
  }
  if (const auto scatter = cursor.find("scatter")) map.scatter = scatter->number({0, most_scatter});
  if (const auto rate = cursor.find("rate_hz")) {
    map.rate_hz = rate->number();
    if (!(*map.rate_hz > 0 && std::isfinite(1 / *map.rate_hz))) rate->fail("a rate > 0 in Hz");
    if (column || !map.unit.empty() || map.scatter)
      rate->fail("no other member: it stands for files in which no column tells the time");
  }
  cursor.done();
  return map;
}

/// The member of the record, or of the set.
std::optional<JsonCursor> own_or_shared(const JsonCursor& set, const JsonCursor& record, const char* key) {
  auto shared = set.find(key), own = record.find(key);
  return own ? own : shared;
}

void add_column_maps(const JsonCursor& set, std::vector<ColumnMap>& maps) {
  const auto columns = set.find("columns");
  if (!columns) return;
  if (!columns->is_object()) columns->fail("an object of columns by channel");
  for (const auto& [channel, ignored] : columns->raw().items()) {
    std::erase_if(maps, [&](const ColumnMap& map) { return map.channel == channel; });
    maps.push_back(read_column_map(channel, columns->at(channel)));
  }
}

/// The map of a channel; of one that records.json does not name, by its own name.
ColumnMap map_of(const Channel& channel, const ReadingRequest& request) {
  for (const ColumnMap& map : request.columns)
    if (map.channel == channel.name) {
      ColumnMap own = map;
      if (own.column.empty()) own.column = channel.name;
      return own;
    }
  ColumnMap map;
  map.channel = map.column = channel.name;
  return map;
}

/// Places of the columns that a name means: those called so, else those called so before their unit.
std::vector<std::size_t> places_of(const std::vector<std::string>& names, const std::string& name) {
  std::vector<std::size_t> whole, base;
  for (std::size_t j = 0; j < names.size(); ++j) {
    if (names[j] == name) whole.push_back(j);
    if (split_name(names[j]).base == name) base.push_back(j);
  }
  return whole.empty() ? base : whole;
}

std::vector<std::string> known_names(const TextLayout& layout) {
  std::vector<std::string> names;
  for (const std::string& name : layout.names)
    if (!name.empty()) names.push_back(name);
  return names;
}

[[noreturn]] void refuse_missing(const std::string& source, const TextLayout& layout, const std::string& name,
                                 const std::string& channel, const std::vector<Channel>& channels) {
  std::vector<std::string> free;
  for (const std::string& other : known_names(layout))
    if (std::none_of(channels.begin(), channels.end(), [&](const Channel& own) { return own.name == other; }))
      free.push_back(other);
  const std::string nearest = nearest_name(name, free);
  const std::string found =
      fmt::format("{}: expected a column \"{}\", found only: {}", source, name, join_names(known_names(layout)));
  if (nearest.empty())
    throw UserError(fmt::format("{}; say \"columns\": {{\"{}\": \"NAME\"}} for the one that holds it", found, channel));
  throw UserError(fmt::format("{}; did you mean \"{}\" by \"{}\"? Then say \"columns\": {{\"{}\": \"{}\"}}", found,
                              name, nearest, channel, nearest));
}

/// The unit behind the underscore of "t_ms" or "time_s"; empty where that is none of time.
std::string unit_behind_underscore(const std::string& name) {
  const std::size_t at = name.rfind('_');
  if (at == std::string::npos) return "";
  const auto unit = find_unit(name.substr(at + 1));
  return unit && unit->powers == find_unit("s")->powers ? name.substr(at + 1) : "";
}

/// Columns whose names say that they hold the time.
std::vector<std::string> time_columns(const TextLayout& layout) {
  std::vector<std::string> list;
  for (const std::string& name : known_names(layout))
    if (is_time_name(name)) list.push_back(name);
  return list;
}

[[noreturn]] void refuse_no_time(const std::string& source, const TextLayout& layout, const std::string& name) {
  const std::vector<std::string> named = time_columns(layout);
  const std::string likely = named.empty() ? "NAME" : named.front();
  throw UserError(
      fmt::format("{}: expected a column \"{}\", found only: {}; say \"time\": \"{}\" for the column that tells the "
                  "time, or \"time\": {{\"rate_hz\": 200}} where none does",
                  source, name, join_names(known_names(layout)), likely));
}

/// Place of a column in the layout. @param missing says that there is none
template <class Missing>
std::size_t place_of(const TextLayout& layout, const std::string& source, const std::string& name, Index number,
                     const char* key, Missing&& missing) {
  if (number > 0) {
    if (number > static_cast<Index>(layout.names.size()))
      throw UserError(fmt::format("{}: expected a column {}, found only {}", source, number, layout.names.size()));
    return static_cast<std::size_t>(number - 1);
  }
  const std::vector<std::size_t> places = places_of(layout.names, name);
  if (places.empty()) missing();
  if (places.size() > 1)
    throw UserError(
        fmt::format("{}: line {}: expected one column \"{}\", found columns {} and {}; say which by its "
                    "number in \"{}\"",
                    source, layout.header_line, name, places[0] + 1, places[1] + 1, key));
  return places.front();
}

[[noreturn]] void refuse_unit(const std::string& source, const std::string& column, const std::string& found,
                              const std::string& channel) {
  throw UserError(
      fmt::format("{}: column \"{}\": expected a unit that is known ({}), found \"{}\"; say \"columns\": "
                  "{{\"{}\": {{\"column\": \"{}\", \"unit\": \"...\"}}}}",
                  source, column, known_units(), excerpt(found), channel, column));
}

/// What the numbers of a column have to go through.
struct Conversion {
  double factor = 1, offset = 0;
  std::string told;  ///< empty: nothing
};

Conversion conversion_of(const Channel& channel, const ColumnMap& map, const std::string& column,
                         const std::string& told_unit, const std::string& source) {
  const std::string& unit = map.unit.empty() ? told_unit : map.unit;
  Conversion out{map.scale, map.offset, ""};
  const auto tell = [&](const std::string& from, const std::string& to) {
    if (out.factor == 1 && out.offset == 0) return;
    out.told = fmt::format("{}: column \"{}\"{} times {:.9g}{}{}", channel.name, column, from, out.factor,
                           out.offset != 0 ? fmt::format(" plus {:.9g}", out.offset) : "", to);
  };
  if (unit.empty()) {
    if (!map.sensitivity.empty())
      throw UserError(
          fmt::format("{}: expected the unit of the numbers beside \"sensitivity\", found none in {} either; "
                      "say \"unit\": \"V\"",
                      map.where, source));
    tell("", "");
    return out;
  }
  if (map.sensitivity.empty() && (channel.unit.empty() || channel.unit == unit)) {
    tell("", "");
    return out;
  }
  const auto from = find_unit(unit);
  if (!from) refuse_unit(source, column, unit, channel.name);
  const Unit quantity = map.sensitivity.empty() ? *from : *from / *find_sensitivity(map.sensitivity);
  const auto to = channel.unit.empty() ? std::optional(Unit{1, quantity.powers}) : find_unit(channel.unit);
  const auto factor = to ? conversion_factor(quantity, *to) : std::nullopt;
  if (!factor)
    throw UserError(fmt::format(
        "{}: column \"{}\": expected a unit that becomes \"{}\", the unit of channel \"{}\", found \"{}\"{}; say "
        "\"columns\": {{\"{}\": {{\"column\": \"{}\", \"unit\": \"...\"}}}}, with \"sensitivity\": \"100 mV/g\" for a "
        "voltage",
        source, column, channel.unit, channel.name, unit,
        map.sensitivity.empty() ? "" : fmt::format(" by \"{}\"", map.sensitivity), channel.name, column));
  out.factor *= *factor;
  out.offset *= *factor;
  tell(fmt::format(" in {}{}", unit, map.sensitivity.empty() ? "" : fmt::format(" by {}", map.sensitivity)),
       channel.unit.empty() ? " in SI units" : fmt::format(" to {}", channel.unit));
  return out;
}

}  // namespace

bool is_time_name(const std::string& name) {
  const std::string base = lower_case(split_name(name).base);
  const auto begins = [&](const char* word) { return base.starts_with(word); };
  return base == "t" || (begins("t_") && !unit_behind_underscore(base).empty()) || begins("time") || begins("zeit") ||
         begins("date");
}

bool is_mat_name(const fs::path& file) {
  std::string name = lower_case(file.filename().string());
  if (name.ends_with(".mat")) return true;
  if (name.ends_with(".gz")) name.resize(name.size() - 3);
  for (const char* ending : {".csv", ".txt", ".tsv", ".dat", ".asc"})
    if (name.ends_with(ending)) return false;
  require_file(file);  // what is not there has no wrong ending
  throw UserError(fmt::format(
      "{}: expected a file name ending in .csv, .txt, .tsv, .dat or .asc, in one of these and .gz, or in .mat",
      file.string()));
}

std::string column_unit(const TextLayout& layout, std::size_t place, const std::string& asked) {
  const std::string& name = layout.names[place];
  const ColumnName split = split_name(name);
  // What stands in brackets behind the name that was asked for is a unit; in a name that was asked for whole, it may be
  // anything.
  if (!split.unit.empty() && (asked != name || find_unit(split.unit))) return split.unit;
  if (place >= layout.units.size()) return "";
  std::string_view unit = trim(layout.units[place]);
  if (unit == "[]" || unit == "()") unit = "";
  if (unit.size() > 2 && ((unit.front() == '[' && unit.back() == ']') || (unit.front() == '(' && unit.back() == ')')))
    unit = trim(unit.substr(1, unit.size() - 2));
  return std::string(unit);
}

ReadingRequest read_reading_request(const JsonCursor& set, const JsonCursor& record) {
  ReadingRequest request;
  add_column_maps(set, request.columns);
  add_column_maps(record, request.columns);
  if (const auto format = own_or_shared(set, record, "format")) request.layout = read_layout_hints(*format);
  if (const auto time = own_or_shared(set, record, "time")) request.time = read_time_map(*time);
  if (const auto lost = own_or_shared(set, record, "lost_samples")) {
    const std::string rule = lost->one_of({"refuse", "bridge", "cut"});
    request.lost = rule == "bridge" ? LostRule::bridge : rule == "cut" ? LostRule::cut : LostRule::refuse;
  }
  return request;
}

FileTable::FileTable(const fs::path& file, const ReadingRequest& request, const std::vector<Channel>& channels)
    : file_(file), source_(file.string()), lost_(request.lost), time_(request.time), text_(!is_mat_name(file)) {
  std::vector<Channel> in_file;
  for (const Channel& channel : channels) {
    constants_.push_back(map_of(channel, request).value);
    if (!constants_.back())
      in_file.push_back(channel);
    else
      told_.push_back(fmt::format("{}: {:g} throughout, from no column", channel.name, *constants_.back()));
  }
  try {
    if (text_)
      read_text_file(request, in_file);
    else
      read_mat_file(request, in_file);
  } catch (const std::bad_alloc&) {
    throw MachineError(fmt::format("{}: not enough memory for its table", source_));
  }
}

void FileTable::read_text_file(const ReadingRequest& request, const std::vector<Channel>& channels) {
  const std::string text = read_text(file_);
  std::vector<std::string> asked;
  if (!time_.rate_hz && time_.number == 0) asked.push_back(time_.column);
  for (const Channel& channel : channels) {
    const ColumnMap map = map_of(channel, request);
    if (map.number == 0) asked.push_back(map.column);
  }
  const TextLayout layout = find_layout(text, request.layout, asked, source_);
  std::vector<WantedColumn> wanted;
  std::vector<std::size_t> places;
  std::string told_time;
  if (!time_.said && places_of(layout.names, time_.column).empty())
    if (const std::vector<std::string> named = time_columns(layout); named.size() == 1) {
      time_.column = named.front();
      time_.unit = unit_behind_underscore(time_.column);
      told_time = fmt::format("time: column \"{}\"", time_.column);
    }
  if (!time_.rate_hz) {
    places.push_back(place_of(layout, source_, time_.column, time_.number, "time",
                              [&] { refuse_no_time(source_, layout, time_.column); }));
    wanted.push_back({places.back(), layout.instants[places.back()]});
  }
  for (const Channel& channel : channels) {
    const ColumnMap map = map_of(channel, request);
    places.push_back(place_of(layout, source_, map.column, map.number, "columns",
                              [&] { refuse_missing(source_, layout, map.column, channel.name, channels); }));
    wanted.push_back({places.back(), false});
  }
  names_ = known_names(layout);
  for (std::string& sentence : layout_told(layout)) told_.push_back(std::move(sentence));
  if (!told_time.empty()) told_.push_back(told_time);
  use_columns(request, channels, layout, places);
  if (!time_.rate_hz && layout.instants[places.front()]) time_factor_ = 1;
  table_ = read_text_table(text, layout, wanted);
}

void FileTable::read_mat_file(const ReadingRequest& request, const std::vector<Channel>& channels) {
  TextLayout layout;
  const auto add = [&](const std::string& name, Index number) {
    if (number > 0)
      throw UserError(fmt::format("{}: expected the name of a variable, found the number {}", source_, number));
    layout.names.push_back(name);
  };
  if (!time_.rate_hz) add(time_.column, time_.number);
  for (const Channel& channel : channels) {
    const ColumnMap map = map_of(channel, request);
    add(map.column, map.number);
  }
  std::vector<std::size_t> places;
  for (std::size_t i = 0; i < layout.names.size(); ++i) places.push_back(i);
  Table table = read_mat(file_, layout.names, false);
  table_.columns = std::move(table.columns);
  names_ = table.names;
  use_columns(request, channels, layout, places);
}

void FileTable::use_columns(const ReadingRequest& request, const std::vector<Channel>& channels,
                            const TextLayout& layout, const std::vector<std::size_t>& places) {
  std::size_t next = 0;
  if (!time_.rate_hz) {
    const std::size_t place = places[next++];
    wanted_.push_back(layout.names[place]);
    const bool instants = place < layout.instants.size() && layout.instants[place];
    const std::string unit = !time_.unit.empty() ? time_.unit
                             : instants
                                 ? ""
                                 : column_unit(layout, place, time_.number > 0 ? layout.names[place] : time_.column);
    if (!unit.empty()) {
      const auto known = find_unit(unit);
      if (!known || known->powers != find_unit("s")->powers)
        throw UserError(
            fmt::format("{}: column \"{}\": expected a unit of time, found \"{}\"; say \"time\": "
                        "{{\"column\": \"{}\", \"unit\": \"s\"}}",
                        source_, wanted_.back(), excerpt(unit), wanted_.back()));
      time_factor_ = known->factor;
      if (known->factor != 1) told_.push_back(fmt::format("time: column \"{}\" in {}", wanted_.back(), unit));
    }
    if (instants) told_.push_back(fmt::format("time: column \"{}\" as date and time", wanted_.back()));
  }
  for (const Channel& channel : channels) {
    const std::size_t place = places[next++];
    const ColumnMap map = map_of(channel, request);
    const std::string& column = layout.names[place];
    wanted_.push_back(column);
    const Conversion conversion =
        conversion_of(channel, map, column, column_unit(layout, place, map.number > 0 ? column : map.column), source_);
    conversions_.emplace_back(conversion.factor, conversion.offset);
    if (!conversion.told.empty())
      told_.push_back(conversion.told);
    else if (split_name(column).base != channel.name && column != channel.name)
      told_.push_back(fmt::format("{}: column \"{}\"", channel.name, column));
  }
}

std::string FileTable::place(Index sample) const {
  return text_ ? fmt::format("line {}", table_.line_of(sample)) : fmt::format("sample {}", sample);
}

Index FileTable::line(Index sample) const { return text_ ? table_.line_of(sample) : 0; }

void FileTable::require_finite(Index first, Index count) const {
  table_.require_sound(first, first + count, source_);
  if (text_) return;
  for (Index i = 0; i < table_.columns.rows(); ++i)
    for (Index k = first; k < first + count; ++k)
      if (!std::isfinite(table_.columns(i, k)))
        throw UserError(fmt::format("{}: variable \"{}\": expected finite numbers, found {} at sample {}", source_,
                                    wanted_[static_cast<std::size_t>(i)], table_.columns(i, k), k));
}

FileTable::Stretch FileTable::take(Index first, Index count, std::optional<double> sampling_hz) const {
  Stretch out = take_columns(first, count, sampling_hz);
  const Matrix columns = std::move(out.values);
  out.values.resize(static_cast<Index>(constants_.size()), columns.cols());
  Index next = 0;
  for (std::size_t i = 0; i < constants_.size(); ++i)
    if (const auto row = static_cast<Index>(i); constants_[i])
      out.values.row(row).setConstant(*constants_[i]);
    else
      out.values.row(row) = columns.row(next++);
  return out;
}

FileTable::Stretch FileTable::take_columns(Index first, Index count, std::optional<double> sampling_hz) const {
  require_finite(first, count);
  Stretch out{0, first, count, {}, told_};
  const Index timed = time_.rate_hz ? 0 : 1;
  TimeGrid grid;
  if (time_.rate_hz) {
    grid.sampling_hz = *time_.rate_hz;
    if (sampling_hz && std::abs(*sampling_hz / grid.sampling_hz - 1) > 1e-9)
      throw UserError(fmt::format("{}: expected samples at sampling_hz = {:.9g} Hz, found \"rate_hz\": {:.9g}", source_,
                                  *sampling_hz, grid.sampling_hz));
    out.told.push_back(fmt::format("no column of time: samples at {:g} Hz", grid.sampling_hz));
  } else {
    if (!sampling_hz && !time_factor_)
      throw UserError(
          fmt::format("{}: expected \"sampling_hz\", or the unit of column \"{}\", found neither; say "
                      "\"sampling_hz\": 200, or \"time\": {{\"column\": \"{}\", \"unit\": \"s\"}}",
                      source_, wanted_.front(), wanted_.front()));
    const Vector t = table_.columns.row(0).segment(first, count).transpose();
    grid = fit_time_grid(t, {sampling_hz, time_factor_.value_or(1), time_.scatter, lost_ != LostRule::refuse,
                             wanted_.front(), source_, [&](Index k) { return place(first + k); }});
    if (grid.scatter > 0)
      out.told.push_back(
          fmt::format("instants scatter by up to {:.2g} of a period: samples taken to lie on the grid of "
                      "{:.9g} Hz",
                      grid.scatter, grid.sampling_hz));
  }
  out.sampling_hz = grid.sampling_hz;
  out.values = table_.columns.block(timed, first, table_.columns.rows() - timed, count);
  for (Index i = 0; i < out.values.rows(); ++i)
    if (const auto& [scale, offset] = conversions_[static_cast<std::size_t>(i)]; scale != 1 || offset != 0)
      out.values.row(i) = (scale * out.values.row(i).array() + offset).matrix();
  if (grid.lost.empty()) return out;
  if (lost_ == LostRule::cut) {
    const auto [begin, length] = longest_whole(count, grid.lost);
    if (length < 2)
      throw UserError(
          fmt::format("{}: expected a stretch of two samples or more without lost ones, found none", source_));
    out.told.push_back(
        fmt::format("samples are lost at {} places: kept the longest stretch without, samples [{}, {}) of the file",
                    grid.lost.size(), first + begin, first + begin + length));
    out.values = Matrix(out.values.middleCols(begin, length));
    out.first = first + begin;
    out.rows = length;
    return out;
  }
  std::string places;
  for (const LostSamples& gap : grid.lost) {
    if (gap.count > longest_bridge)
      throw UserError(
          fmt::format("{}: {}: expected at most {} lost samples to bridge, found {}; say \"lost_samples\": "
                      "\"cut\", or take a \"range\" without them",
                      source_, place(first + gap.before), longest_bridge, gap.count));
    places += fmt::format("{}{} before {}", places.empty() ? "" : ", ", gap.count, place(first + gap.before));
  }
  out.told.push_back(fmt::format("lost samples bridged by cubic polynomials: {}", places));
  out.values = bridge(out.values, grid.lost);
  return out;
}

}  // namespace wheelhop
