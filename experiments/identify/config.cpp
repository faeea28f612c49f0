#include <fmt/format.h>

#include <algorithm>

#include "core/identify/excitation.hpp"
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

/// The records to train on: the one that is chosen by file name or number, or all for estimation.
void choose_records(const std::optional<JsonCursor>& choice, const std::filesystem::path& file,
                    IdentifyConfig& config) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < config.set.records.size(); ++i) {
    const Record& record = config.set.records[i];
    if (record.role == "estimation" && !choice) config.trained.push_back(static_cast<Index>(i));
    names.push_back(record.file);
  }
  if (choice && choice->is_number()) {
    config.trained = {choice->integer(0, static_cast<Index>(names.size()) - 1)};
  } else if (choice) {
    const std::string wanted = choice->one_of(names);
    if (std::count(names.begin(), names.end(), wanted) > 1)
      choice->fail("the number of a record, as several are parts of this file");
    config.trained = {std::find(names.begin(), names.end(), wanted) - names.begin()};
  }
  if (config.trained.empty())
    throw UserError(fmt::format("{}: $.records: expected a record of role \"estimation\", found none among {}",
                                file.string(), join_names(names)));
}

void require_movement(ConstMatrixRef rows, const std::vector<Channel>& channels, const char* kind,
                      const std::string& where) {
  for (Index i = 0; i < rows.rows(); ++i)
    if (rows.row(i).minCoeff() == rows.row(i).maxCoeff())
      throw UserError(fmt::format("{}: expected an {} that moves, found \"{}\" constant at {:g}{}", where, kind,
                                  channels[static_cast<std::size_t>(i)].name, rows(i, 0),
                                  kind[0] == 'i' ? " (persistently exciting of order 1 at most)" : ""));
}

/// Sec. 2.7, assumption 1, as the subspace piece of the config needs it.
void check_needs(const Signal& signal, const std::string& where, IdentifyConfig& config) {
  const Index m = signal.input_count(), p = signal.output_count();
  const RecordNeeds needs = config.pieces.subspace.piece->needs(m, p);
  if (signal.samples() < needs.samples)
    throw UserError(fmt::format(
        "{}: expected at least {} samples for {} ($.subspace), {} input(s) and {} output(s), found {}; lower "
        "them or take a longer record",
        where, needs.samples, needs.because, m, p, signal.samples()));
  config.excitation_needed = needs.excitation;
  config.excitation_found =
      persistency_of_excitation(signal.u, config.excitation_needed, config.options.excitation_tolerance);
  if (config.excitation_found < config.excitation_needed)
    throw UserError(fmt::format(
        "{}: expected an input that is persistently exciting of order {} for {} ($.subspace; Sec. 2.7, assumption 1), "
        "found order {} at a relative singular value of {:g}; a sine has order 2, a sum of n sines 2 n",
        where, config.excitation_needed, needs.because, config.excitation_found, config.options.excitation_tolerance));
}

/// That the outputs follow more of the drive than one sine.
void check_followed(const Signal& signal, const std::string& where, IdentifyConfig& config) {
  constexpr Index beyond_one_sine = 3;
  config.excitation_needed = beyond_one_sine;
  config.excitation_found = followed_directions(signal.u, signal.y, beyond_one_sine);
  if (config.excitation_found >= beyond_one_sine) return;
  if (config.excitation_found == 0)
    throw UserError(fmt::format(
        "{}: expected outputs that follow the inputs, found none that does beyond chance; look for inputs and outputs "
        "of different tests, for swapped columns and for a drive that is lost in noise",
        where));
  throw UserError(fmt::format(
      "{}: expected a drive of more than one frequency, found that the outputs follow {} direction(s) of its past, as "
      "of one sine; the rest of the drive is noise that they do not follow (Sec. 2.7, assumption 1). Drive the plant "
      "with a sweep, a sum of sines or noise",
      where, config.excitation_found));
}

void check_record(const std::filesystem::path& file, Index number, IdentifyConfig& config) {
  const Record& record = config.set.records[static_cast<std::size_t>(number)];
  const Signal& signal = record.signal;
  const std::string where = fmt::format("{}: $.records[{}] ({})", file.string(), number, record.file);
  require_movement(signal.u, signal.inputs, "input", where);
  require_movement(signal.y, signal.outputs, "output", where);
  if (const Index i = collinear_input(signal.u); i >= 0)
    throw UserError(
        fmt::format("{}: expected inputs that move on their own, found \"{}\" to be a combination of the others "
                    "(collinear inputs); "
                    "leave it out, or drive the plant so that they differ",
                    where, signal.inputs[static_cast<std::size_t>(i)].name));
  if (config.delivery.search)
    check_followed(signal, where, config);
  else
    check_needs(signal, where, config);
}

void check_nonlinearities(const JsonCursor& cursor, const IdentifyConfig& config) {
  const auto p = static_cast<Index>(config.outputs.size()), m = static_cast<Index>(config.inputs.size());
  const Index q = config.delivery.pipeline.nonlinearities;
  if (config.delivery.pipeline.direction == "input" && q > m)
    throw UserError(
        fmt::format("{}: $.pipeline.nonlinearities: expected at most {} (the inputs) with direction "
                    "\"input\", found {}",
                    cursor.where(), m, q));
  if (config.delivery.pipeline.direction != "input" && q > 0 && q >= p)
    throw UserError(fmt::format(
        "{}: $.pipeline.nonlinearities: expected at most {}, one fewer than the outputs (Sec. 2.7, assumption 2), "
        "found {}; measure another output, or set $.pipeline.direction to \"input\" where f enters as the inputs do",
        cursor.where(), p - 1, q));
}

/// What the config leaves out of the pipeline and the number of channels or the record decide.
void choose_by_evidence(const JsonCursor& cursor, IdentifyConfig& config) {
  const auto pipeline = cursor.find("pipeline");
  const auto given = [&](const char* field) { return pipeline && pipeline->has(field); };
  config.delivery.choose_direct_term = !given("direct_term");
  config.delivery.starts = config.options.starts;
  config.delivery.cut_off_outputs = config.options.cut_off_outputs;
  // Eq. (17) needs q < p. With fewer outputs f can only be taken to enter as the inputs do.
  const PipelineOptions& options = config.delivery.pipeline;
  const bool too_few = options.nonlinearities >= static_cast<Index>(config.outputs.size());
  if (!given("direction") && too_few && options.nonlinearities <= static_cast<Index>(config.inputs.size()))
    config.delivery.pipeline.direction = "input";
}

Json effective(const IdentifyConfig& config) {
  const auto channels = [](const std::vector<Channel>& list) {
    Json out = Json::array();
    for (const Channel& channel : list) out.push_back({{"name", channel.name}, {"unit", channel.unit}});
    return out;
  };
  Json out = {{"inputs", channels(config.inputs)}, {"outputs", channels(config.outputs)}};
  if (config.trained.size() == 1) out["record"] = config.trained.front();
  out.update(write_options(config.options));
  out.update(config.pieces.config());
  if (config.delivery.search) {
    out.erase("subspace");
    out["linear"] = write_options(*config.delivery.search);
  }
  out["pipeline"] = write_options(config.delivery.pipeline);
  return out;
}

}  // namespace

std::vector<Signal> IdentifyConfig::training() const {
  std::vector<Signal> records;
  for (const Index number : trained) records.push_back(set.records[static_cast<std::size_t>(number)].signal);
  return records;
}

bool IdentifyConfig::trains_on(std::size_t record) const {
  return std::find(trained.begin(), trained.end(), static_cast<Index>(record)) != trained.end();
}

IdentifyConfig read_identify_config(const std::filesystem::path& file, const std::filesystem::path& records) {
  const JsonCursor cursor = JsonCursor::load(file);
  IdentifyConfig config;
  read_all_channels(cursor, config);
  config.options = read_options<IdentifyOptions>(cursor);
  config.pieces = read_pieces(cursor);
  config.delivery.initial_state_samples = config.options.initial_state_samples;
  const auto search = cursor.find("linear");
  if (search && cursor.has("subspace"))
    throw UserError(cursor.where() +
                    ": expected either \"subspace\", a piece for step 1, or \"linear\", the options of the search "
                    "that takes its place, found both");
  if (!cursor.has("subspace")) {
    config.delivery.search = search ? read_options<LinearSearchOptions>(*search) : LinearSearchOptions();
    if (search) search->done();
  }
  if (const auto order = cursor.find("order")) config.delivery.pipeline.order = order->integer(0, 100);
  const Index order = config.delivery.pipeline.order;
  config.delivery.pipeline = read_pipeline(cursor, config.delivery.pipeline);
  if (cursor.has("order") && config.delivery.pipeline.order != order)
    throw UserError(fmt::format("{}: expected one order, found $.order = {} and $.pipeline.order = {}", cursor.where(),
                                order, config.delivery.pipeline.order));
  choose_by_evidence(cursor, config);
  const auto choice = cursor.find("record");
  if (choice && !choice->is_number() && !choice->is_string()) choice->fail("the file name or number of a record");
  cursor.done();
  check_nonlinearities(cursor, config);
  config.set = load_records(records, config.inputs, config.outputs);
  require_sound_records(config.set, records);
  require_held_out(config.set, records);
  choose_records(choice, records, config);
  for (const Index number : config.trained) check_record(records, number, config);
  config.effective = effective(config);
  return config;
}

}  // namespace wheelhop
