#include <fmt/format.h>

#include <algorithm>

#include "core/kernels/hankel.hpp"
#include "core/plant/plant.hpp"
#include "experiments/identify/study.hpp"
#include "experiments/run/input_checks.hpp"

namespace wheelhop {
namespace {

std::vector<Channel> read_channels(const JsonCursor& list, std::vector<std::string>& seen) {
  std::vector<Channel> channels;
  for (const JsonCursor& item : list.items()) {
    Channel channel{item.at("name").string(), item.string("unit", "")};
    if (channel.name.empty() || channel.name == "t") item.at("name").fail("the name of a channel other than \"t\"");
    if (std::find(seen.begin(), seen.end(), channel.name) != seen.end())
      item.at("name").fail("a name that no other channel has");
    seen.push_back(channel.name);
    item.done();
    channels.push_back(std::move(channel));
  }
  if (channels.empty()) list.fail("at least one channel");
  return channels;
}

void read_all_channels(const JsonCursor& cursor, IdentifyConfig& config) {
  if (const auto plant_file = cursor.find("plant")) {
    if (cursor.has("inputs") || cursor.has("outputs"))
      throw UserError(cursor.where() + ": expected either \"plant\" or \"inputs\" and \"outputs\", found both");
    const Plant plant = plant_file->is_string() ? load_acting_plant(plant_file->directory() / plant_file->string())
                                                : require_acting_inputs(parse_plant(*plant_file), plant_file->where());
    config.inputs = plant.input_channels();
    config.outputs = plant.output_channels();
    return;
  }
  std::vector<std::string> seen;
  config.inputs = read_channels(cursor.at("inputs"), seen);
  config.outputs = read_channels(cursor.at("outputs"), seen);
}

/// The estimation record: by file name, by number, or the first.
void choose_record(const std::optional<JsonCursor>& choice, const std::filesystem::path& file, IdentifyConfig& config) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < config.set.records.size(); ++i) {
    const Record& record = config.set.records[i];
    if (record.role == "estimation" && config.record_index < 0 && !choice) config.record_index = static_cast<Index>(i);
    names.push_back(record.file);
  }
  if (choice && choice->is_number()) {
    config.record_index = choice->integer(0, static_cast<Index>(names.size()) - 1);
  } else if (choice) {
    const std::string wanted = choice->one_of(names);
    if (std::count(names.begin(), names.end(), wanted) > 1)
      choice->fail("the number of a record, as several are parts of this file");
    config.record_index = std::find(names.begin(), names.end(), wanted) - names.begin();
  }
  if (config.record_index < 0)
    throw UserError(fmt::format("{}: $.records: expected a record of role \"estimation\", found none among {}",
                                file.string(), join_names(names)));
  config.record = names[static_cast<std::size_t>(config.record_index)];
}

void require_movement(ConstMatrixRef rows, const std::vector<Channel>& channels, const char* kind,
                      const std::string& where) {
  for (Index i = 0; i < rows.rows(); ++i)
    if (rows.row(i).minCoeff() == rows.row(i).maxCoeff())
      throw UserError(fmt::format("{}: expected an {} that moves, found \"{}\" constant at {:g}{}", where, kind,
                                  channels[static_cast<std::size_t>(i)].name, rows(i, 0),
                                  kind[0] == 'i' ? " (persistently exciting of order 1 at most)" : ""));
}

void check_record(const std::filesystem::path& file, IdentifyConfig& config) {
  const Signal& signal = config.training();
  const std::string where = fmt::format("{}: $.records[{}] ({})", file.string(), config.record_index, config.record);
  const Index m = signal.input_count(), p = signal.output_count();
  const RecordNeeds needs = config.pieces.subspace.piece->needs(m, p);
  if (signal.samples() < needs.samples)
    throw UserError(fmt::format(
        "{}: expected at least {} samples for {} ($.subspace), {} input(s) and {} output(s), found {}; lower "
        "them or take a longer record",
        where, needs.samples, needs.because, m, p, signal.samples()));
  require_movement(signal.u, signal.inputs, "input", where);
  require_movement(signal.y, signal.outputs, "output", where);
  config.excitation_needed = needs.excitation;
  config.excitation_found =
      persistency_of_excitation(signal.u, config.excitation_needed, config.options.excitation_tolerance);
  if (config.excitation_found < config.excitation_needed)
    throw UserError(fmt::format(
        "{}: expected an input that is persistently exciting of order {} for {} ($.subspace; Sec. 2.7, assumption 1), "
        "found order {} at a relative singular value of {:g}; a sine has order 2, a sum of n sines 2 n",
        where, config.excitation_needed, needs.because, config.excitation_found, config.options.excitation_tolerance));
}

void check_nonlinearities(const JsonCursor& cursor, const IdentifyConfig& config) {
  const auto p = static_cast<Index>(config.outputs.size()), m = static_cast<Index>(config.inputs.size());
  const Index q = config.pipeline.nonlinearities;
  if (config.pipeline.direction == "input" && q > m)
    throw UserError(
        fmt::format("{}: $.pipeline.nonlinearities: expected at most {} (the inputs) with direction "
                    "\"input\", found {}",
                    cursor.where(), m, q));
  if (config.pipeline.direction != "input" && q >= p)
    throw UserError(fmt::format(
        "{}: $.pipeline.nonlinearities: expected at most {}, one fewer than the outputs (Sec. 2.7, assumption 2), "
        "found {}; measure another output, or set $.pipeline.direction to \"input\" where f enters as the inputs do",
        cursor.where(), p - 1, q));
}

Json effective(const IdentifyConfig& config) {
  const auto channels = [](const std::vector<Channel>& list) {
    Json out = Json::array();
    for (const Channel& channel : list) out.push_back({{"name", channel.name}, {"unit", channel.unit}});
    return out;
  };
  Json out = {
      {"inputs", channels(config.inputs)}, {"outputs", channels(config.outputs)}, {"record", config.record_index}};
  out.update(write_options(config.options));
  out.update(config.pieces.config());
  out["pipeline"] = write_options(config.pipeline);
  return out;
}

}  // namespace

IdentifyConfig read_identify_config(const std::filesystem::path& file, const std::filesystem::path& records) {
  const JsonCursor cursor = JsonCursor::load(file);
  IdentifyConfig config;
  read_all_channels(cursor, config);
  config.options = read_options<IdentifyOptions>(cursor);
  config.pieces = read_pieces(cursor);
  if (const auto order = cursor.find("order")) config.pipeline.order = order->integer(0, 100);
  const Index order = config.pipeline.order;
  config.pipeline = read_pipeline(cursor, config.pipeline);
  if (cursor.has("order") && config.pipeline.order != order)
    throw UserError(fmt::format("{}: expected one order, found $.order = {} and $.pipeline.order = {}", cursor.where(),
                                order, config.pipeline.order));
  const auto choice = cursor.find("record");
  if (choice && !choice->is_number() && !choice->is_string()) choice->fail("the file name or number of a record");
  cursor.done();
  check_nonlinearities(cursor, config);
  config.set = load_records(records, config.inputs, config.outputs);
  require_sound_records(config.set, records);
  require_held_out(config.set, records);
  choose_record(choice, records, config);
  check_record(records, config);
  config.effective = effective(config);
  return config;
}

}  // namespace wheelhop
