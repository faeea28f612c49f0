#include "core/data/records.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <stdexcept>
#include <string_view>

#include "core/base/files.hpp"
#include "core/base/json.hpp"
#include "core/base/status.hpp"
#include "core/data/reading.hpp"
#include "core/data/resample.hpp"
#include "core/data/table.hpp"

namespace wheelhop {
namespace fs = std::filesystem;
namespace {

const std::vector<std::string> kRoles = {"estimation", "validation"};

/// The tables of the set, each read once for every way to read it.
class Tables {
 public:
  Tables(const JsonCursor& set, const std::vector<Channel>& inputs, const std::vector<Channel>& outputs)
      : set_(set), channels_(inputs) {
    channels_.insert(channels_.end(), outputs.begin(), outputs.end());
  }

  const FileTable& get(const std::string& file, const JsonCursor& record) {
    const ReadingRequest request = read_reading_request(set_, record);
    std::string key = file;
    for (const char* member : {"columns", "format", "time", "lost_samples"})
      if (const auto own = record.find(member)) key += '\0' + std::string(member) + own->raw().dump();
    const auto known = tables_.find(key);
    return known != tables_.end() ? known->second
                                  : tables_.try_emplace(key, set_.directory() / file, request, channels_).first->second;
  }

  /// The channels, and every column of every file but the time.
  std::vector<std::string> channel_names() const {
    std::vector<std::string> result;
    for (const Channel& channel : channels_) result.push_back(channel.name);
    for (const auto& [file, table] : tables_)
      for (const std::string& name : table.names())
        if (name != "t" && std::find(result.begin(), result.end(), name) == result.end()) result.push_back(name);
    return result;
  }

 private:
  const JsonCursor& set_;
  std::vector<Channel> channels_;
  std::map<std::string, FileTable> tables_;
};

/// First sample and number of samples that a record takes from a file of `total`.
std::pair<Index, Index> read_range(const JsonCursor& record, Index total) {
  const auto range = record.find("range");
  if (!range) return {0, total};
  const std::vector<JsonCursor> ends = range->items();
  if (ends.size() != 2) range->fail("[first, last) in samples");
  const Index first = ends[0].integer(0), last = ends[1].integer(0);
  if (first >= last) range->fail("[first, last) with first < last");
  if (last > total)
    throw UserError(fmt::format("{}: expected samples within the file, which has {}, found [{}, {})", range->where(),
                                total, first, last));
  return {first, last - first};
}

/// The rates that records.json asks for; none where the files tell.
struct Rates {
  std::optional<double> sampling_hz, resample_hz;
};

std::optional<double> read_rate(const JsonCursor& cursor, const char* key) {
  const auto rate = cursor.find(key);
  if (!rate) return {};
  const double hz = rate->number();
  if (!(hz > 0 && std::isfinite(1 / hz))) rate->fail("a rate > 0 in Hz");
  return hz;
}

/// Brings a stretch to another rate. The number of samples that no score counts grows with it.
void bring_to_rate(FileTable::Stretch& stretch, double hz, Index& skip) {
  if (stretch.sampling_hz == hz) return;
  stretch.told.push_back(fmt::format("resampled from {:.9g} Hz to {:.9g} Hz, band-limited", stretch.sampling_hz, hz));
  stretch.values = resample(stretch.values, stretch.sampling_hz, hz);
  skip = static_cast<Index>(std::ceil(static_cast<double>(skip) * hz / stretch.sampling_hz));
  stretch.sampling_hz = hz;
}

std::map<std::string, double> read_by_name(const JsonCursor& cursor) {
  if (!cursor.is_object()) cursor.fail("an object of numbers by mass");
  std::map<std::string, double> values;
  for (const auto& item : cursor.raw().items()) values[item.key()] = cursor.at(item.key()).number();
  return values;
}

/// `start` of a record, or else of its set.
KnownStart read_start(const JsonCursor& set, const JsonCursor& record) {
  KnownStart start;
  const auto own = record.find("start"), common = set.find("start");
  if (!own && !common) return start;
  const JsonCursor& cursor = own ? *own : *common;
  if (!cursor.is_object()) {
    start.rest = cursor.one_of({"free", "rest"}) == "rest";
    return start;
  }
  KnownStart::fields(start, [&](const char* key, auto, auto, std::map<std::string, double>& values) {
    if (const auto given = cursor.find(key)) values = read_by_name(*given);
  });
  cursor.done();
  return start;
}

/// @param sampling_hz is set to the rate of the record
Record read_record(const JsonCursor& cursor, const JsonCursor& set, const Rates& rates,
                   const std::vector<Channel>& inputs, const std::vector<Channel>& outputs, Tables& tables,
                   double& sampling_hz) {
  Record record;
  const JsonCursor name = cursor.at("file");
  record.file = name.string();
  if (record.file.empty()) name.fail("the name of a file");
  record.role = cursor.at("role").one_of(kRoles);
  record.repeat_of = cursor.string("repeat_of", "");
  const auto skip = cursor.find("skip_initial");
  cursor.find("range");
  for (const char* member : {"columns", "format", "time", "lost_samples"}) cursor.find(member);
  record.start = read_start(set, cursor);
  cursor.done();
  const FileTable& table = tables.get(record.file, cursor);
  const auto [first, count] = read_range(cursor, table.samples());
  if (count < 2)
    throw UserError(
        fmt::format("{}: expected at least two samples of {}, found {}", cursor.where(), record.file, count));
  Signal& signal = record.signal;
  if (skip) {
    signal.skip = skip->integer(0);
    if (signal.skip >= count) skip->fail(fmt::format("fewer than the {} samples of the record", count));
  }
  FileTable::Stretch stretch = table.take(first, count, rates.sampling_hz);
  if (stretch.rows < count && signal.skip >= stretch.rows)
    skip->fail(fmt::format("fewer than the {} samples that \"lost_samples\" leaves", stretch.rows));
  if (rates.resample_hz) bring_to_rate(stretch, *rates.resample_hz, signal.skip);
  if (stretch.values.cols() < 2 || signal.skip >= stretch.values.cols())
    throw UserError(fmt::format("{}: expected a record with samples left at {:g} Hz, found {}", cursor.where(),
                                stretch.sampling_hz, stretch.values.cols()));
  record.first = stretch.first;
  record.rows = stretch.rows;
  record.line = table.line(stretch.first);
  record.reading = std::move(stretch.told);
  const auto m = static_cast<Index>(inputs.size());
  signal.u = stretch.values.topRows(m);
  signal.y = stretch.values.bottomRows(stretch.values.rows() - m);
  sampling_hz = stretch.sampling_hz;
  signal.sample_time_s = 1 / sampling_hz;
  signal.inputs = inputs;
  signal.outputs = outputs;
  return record;
}

void read_noise(const JsonCursor& cursor, const std::vector<std::string>& channels,
                std::map<std::string, double>& out) {
  if (!cursor.is_object()) cursor.fail("an object of standard deviations by channel");
  for (const std::string& name : channels)
    if (const auto value = cursor.find(name)) {
      out[name] = value->number();
      if (!(out[name] > 0)) value->fail("a number > 0");
    }
  cursor.done();
}

/// Files of two generated sets in one folder are records of neither.
void check_identity(const JsonCursor& own) {
  const fs::path beside = own.directory() / "provenance.json";
  std::error_code ignored;
  if (!fs::exists(beside, ignored)) return;
  const auto other = JsonCursor::load(beside).find("set");
  if (other && other->raw() != own.raw())
    own.fail(fmt::format("{} as in {}: the folder holds files of two sets; generate it again", other->raw().dump(),
                         beside.string()));
}

/// Checks the set before anything is written, and gives every record a file name.
std::vector<std::string> file_names(const RecordSet& set) {
  std::vector<std::string> names;
  std::set<std::string> seen;
  for (std::size_t i = 0; i < set.records.size(); ++i) {
    const Record& record = set.records[i];
    const Signal& signal = record.signal;
    const std::string name = record.file.empty() ? fmt::format("record_{}.csv", i + 1) : record.file;
    const auto fail = [&](const char* what) { throw std::invalid_argument("write_records: " + name + ": " + what); };
    if (fs::path(name).filename() != name || name == "records.json") fail("not the name of a file in the folder");
    if (!seen.insert(name).second) fail("two records share this file");
    if (std::find(kRoles.begin(), kRoles.end(), record.role) == kRoles.end()) fail("unknown role");
    if (std::abs(signal.sample_time_s * set.sampling_hz - 1) > 1e-9) fail("another rate than the set");
    if (static_cast<Index>(signal.inputs.size()) != signal.u.rows() ||
        static_cast<Index>(signal.outputs.size()) != signal.y.rows() || signal.u.cols() != signal.y.cols())
      fail("channel names, inputs and outputs differ in number");
    names.push_back(name);
  }
  return names;
}

Json to_json(const KnownStart& start) {
  if (start.rest) return "rest";
  Json out = Json::object();
  KnownStart::fields(start, [&](const char* key, auto, auto, const std::map<std::string, double>& values) {
    if (!values.empty()) out[key] = values;
  });
  return out;
}

Table to_table(const Signal& signal, double sampling_hz) {
  Table table;
  table.names = {"t"};
  for (const Channel& channel : signal.inputs) table.names.push_back(channel.name);
  for (const Channel& channel : signal.outputs) table.names.push_back(channel.name);
  table.columns.resize(static_cast<Index>(table.names.size()), signal.samples());
  // Division, unlike multiplication by the period, gives the double nearest to a short decimal: 0.015, not
  // 0.015000...02.
  for (Index k = 0; k < signal.samples(); ++k) table.columns(0, k) = static_cast<double>(k) / sampling_hz;
  table.columns.middleRows(1, signal.u.rows()) = signal.u;
  table.columns.bottomRows(signal.y.rows()) = signal.y;
  return table;
}

}  // namespace

std::string Record::place(Index sample) const {
  if (rows > 0 && rows != signal.samples())
    return fmt::format("{:.6g} s", static_cast<double>(sample) * signal.sample_time_s);
  return line > 0 ? fmt::format("line {}", line + sample) : fmt::format("sample {}", first + sample);
}

std::vector<const Record*> RecordSet::with_role(const std::string& role) const {
  std::vector<const Record*> result;
  for (const Record& record : records)
    if (record.role == role) result.push_back(&record);
  return result;
}

RecordSet load_records(const fs::path& file, const std::vector<Channel>& inputs, const std::vector<Channel>& outputs) {
  return load_records(file, inputs, outputs, {});
}

RecordSet load_records(const fs::path& file, const std::vector<Channel>& inputs, const std::vector<Channel>& outputs,
                       const std::vector<Channel>& planned) {
  const JsonCursor cursor = JsonCursor::load(file);
  RecordSet set;
  Rates rates{read_rate(cursor, "sampling_hz"), read_rate(cursor, "resample_hz")};
  const JsonCursor list = cursor.at("records");
  const auto noise = cursor.find("noise_std");
  for (const char* member : {"columns", "format", "time", "lost_samples", "start"}) cursor.find(member);
  if (const auto identity = cursor.find("set")) {
    set.identity = identity->string();
    check_identity(*identity);
  }
  cursor.done();
  const std::vector<JsonCursor> items = list.items();
  if (items.empty()) list.fail("at least one record");
  Tables tables(cursor, inputs, outputs);
  for (const JsonCursor& item : items) try {
      set.records.push_back(read_record(item, cursor, rates, inputs, outputs, tables, set.sampling_hz));
      // Where the files tell the rate, the first one tells it for all; resampled records may have one each.
      if (!rates.sampling_hz && !rates.resample_hz) rates.sampling_hz = set.sampling_hz;
    } catch (const MachineError&) {
      throw;
    } catch (const UserError& error) {
      if (std::string_view(error.what()).starts_with(cursor.where())) throw;
      throw UserError(fmt::format("{}.file: {}", item.where(), error.what()));
    }
  if (noise) {
    std::vector<std::string> known = tables.channel_names();
    for (const Channel& channel : planned) known.push_back(channel.name);
    read_noise(*noise, known, set.noise_std);
  }
  return set;
}

void write_records(const fs::path& folder, const RecordSet& set) {
  const std::vector<std::string> names = file_names(set);
  require_writable_folder(folder);
  Json records = Json::array();
  for (std::size_t i = 0; i < names.size(); ++i) {
    const Record& record = set.records[i];
    write_table(folder / names[i], to_table(record.signal, set.sampling_hz));
    Json item = {{"file", names[i]}, {"role", record.role}};
    if (!record.repeat_of.empty()) item["repeat_of"] = record.repeat_of;
    if (record.signal.skip > 0) item["skip_initial"] = record.signal.skip;
    if (record.start != KnownStart{}) item["start"] = to_json(record.start);
    records.push_back(std::move(item));
  }
  Json out = {{"sampling_hz", set.sampling_hz}, {"records", std::move(records)}};
  if (!set.noise_std.empty()) out["noise_std"] = set.noise_std;
  if (!set.identity.empty()) out["set"] = set.identity;
  write_json(folder / "records.json", out);
}

}  // namespace wheelhop
