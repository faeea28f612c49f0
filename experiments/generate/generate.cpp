#include "experiments/generate/generate.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <map>
#include <vector>

#include "core/base/files.hpp"
#include "core/data/noise.hpp"
#include "core/data/records.hpp"
#include "core/plant/dataset.hpp"
#include "core/plant/road.hpp"

#ifndef WHEELHOP_VERSION
#define WHEELHOP_VERSION "unversioned"
#endif

namespace wheelhop {
namespace {

/// The drive of one group of records; no entry = the input stays at zero.
struct DriveGroup {
  std::string role;
  double duration_s = 0;
  Index repeats = 1;
  std::map<Index, DriveOptions> drives;  // by input
};

struct Config {
  Plant plant;
  double sampling_hz = 200;
  Index seed = 1, realisation = 0, substeps = 1;
  std::optional<double> noise_snr_db;
  double settle_s = 2;
  bool from_equilibrium = true;
  std::vector<DriveGroup> groups;
};

Plant read_plant(const JsonCursor& cursor) {
  if (!cursor.is_string()) return parse_plant(cursor);
  return load_plant(cursor.directory() / cursor.string());
}

DriveGroup read_group(const JsonCursor& cursor, const Config& config) {
  DriveGroup group;
  group.role = cursor.at("role").one_of({"estimation", "validation"});
  const JsonCursor duration = cursor.at("duration_s");
  group.duration_s = duration.number({.low = 0, .high = 1e6});
  const double samples = group.duration_s * config.sampling_hz;
  if (samples < 2 || std::abs(samples - std::round(samples)) > 1e-6)
    duration.fail(fmt::format("a duration of at least two whole samples of 1/{} s", config.sampling_hz));
  group.repeats = cursor.integer("repeats", 1, 1, 10000);
  const JsonCursor drive = cursor.at("drive");
  const double hold_hz = config.plant.hold_hz();
  const bool for_all = drive.is_object() && drive.has("name") && drive.at("name").is_string();
  for (Index i = 0; i < config.plant.input_count(); ++i) {
    const PlantInput& input = config.plant.inputs[static_cast<std::size_t>(i)];
    if (for_all)
      group.drives.emplace(i, parse_drive(drive, hold_hz, input.unit));
    else if (auto own = drive.find(input.name))
      group.drives.emplace(i, parse_drive(*own, hold_hz, input.unit));
  }
  if (!for_all) drive.done();
  cursor.done();
  return group;
}

Config read_config(const JsonCursor& cursor) {
  Config config;
  config.plant = read_plant(cursor.at("plant"));
  config.sampling_hz = cursor.number("sampling_hz", config.sampling_hz, {.low = 1e-3, .high = 1e7});
  if (auto member = cursor.find("hold_hz"))
    for (PlantInput& input : config.plant.inputs) input.hold_hz = member->number({.low = 1e-3, .high = 1e7});
  try {
    hold_samples_per_record_sample(config.plant, config.sampling_hz);
  } catch (const UserError& error) {
    throw UserError(cursor.where() + ".sampling_hz: " + error.what());
  }
  config.seed = cursor.integer("seed", 1, 0, std::numeric_limits<Index>::max());
  config.realisation = cursor.integer("realisation", 0, 0, std::numeric_limits<Index>::max());
  config.substeps = cursor.integer("substeps", stable_substeps(config.plant), 1, 1000);
  if (auto member = cursor.find("noise_snr_db"))
    if (!member->raw().is_null()) config.noise_snr_db = member->number({.low = -100, .high = 300});
  config.settle_s = cursor.number("settle_s", config.settle_s, {.low = 0, .high = 1e5});
  if (auto member = cursor.find("start"))
    config.from_equilibrium = member->one_of({"equilibrium", "zero"}) == "equilibrium";
  const JsonCursor records = cursor.at("records");
  for (const JsonCursor& item : records.items()) config.groups.push_back(read_group(item, config));
  if (config.groups.empty()) records.fail("at least one record");
  cursor.done();
  return config;
}

Json effective(const Config& config) {
  Json out = {
      {"plant", to_json(config.plant)},    {"sampling_hz", config.sampling_hz},
      {"hold_hz", config.plant.hold_hz()}, {"seed", config.seed},
      {"realisation", config.realisation}, {"noise_snr_db", config.noise_snr_db ? Json(*config.noise_snr_db) : Json()},
      {"settle_s", config.settle_s},       {"start", config.from_equilibrium ? "equilibrium" : "zero"},
      {"substeps", config.substeps},       {"records", Json::array()}};
  for (const DriveGroup& group : config.groups) {
    Json drives = Json::object();
    for (const auto& [input, options] : group.drives)
      drives[config.plant.inputs[static_cast<std::size_t>(input)].name] = to_json(options);
    out["records"].push_back({{"role", group.role},
                              {"duration_s", group.duration_s},
                              {"drive", std::move(drives)},
                              {"repeats", group.repeats}});
  }
  return out;
}

struct GroupDrive {
  Matrix values;  // m x (lead + samples * ratio)
  Json lines;     // of the multisines, by input
};

GroupDrive make_group_drive(const Config& config, std::size_t group_index, Index lead) {
  const DriveGroup& group = config.groups[group_index];
  const double hold_hz = config.plant.hold_hz();
  const Index samples = std::llround(group.duration_s * config.sampling_hz) *
                        hold_samples_per_record_sample(config.plant, config.sampling_hz);
  GroupDrive result{Matrix::Zero(config.plant.input_count(), lead + samples), Json::object()};
  for (const auto& [input, options] : group.drives) {
    // Cells keep the drives apart; 4096 inputs are more than any plant has.
    Random random(static_cast<std::uint64_t>(config.seed), Stream::road,
                  group_index * 4096 + static_cast<std::size_t>(input), static_cast<std::uint64_t>(config.realisation));
    const Drive drive = make_drive(options, hold_hz, lead, samples, random);
    result.values.row(input) = drive.values;
    if (drive.period_samples > 0)
      result.lines[config.plant.inputs[static_cast<std::size_t>(input)].name] = {
          {"period_s", static_cast<double>(drive.period_samples) / hold_hz},
          {"excited", drive.excited_lines},
          {"odd_detection", drive.odd_detection_lines},
          {"even_detection", drive.even_detection_lines}};
  }
  return result;
}

}  // namespace

int run_generate(const GenerateRequest& request) {
  const JsonCursor cursor = JsonCursor::load(request.config);
  const Config config = read_config(cursor);
  require_writable_folder(request.out);

  const Index lead = std::llround(config.settle_s * config.plant.hold_hz());
  RecordSet set;
  set.sampling_hz = config.sampling_hz;
  Json provenance = {
      {"schema", "wheelhop.dataset/1"}, {"version", WHEELHOP_VERSION}, {"status", "ok"}, {"message", ""}};
  provenance["config"] = effective(config);
  provenance["records"] = Json::array();
  Vector noise_power = Vector::Zero(config.plant.sensor_count());
  std::map<std::string, int> numbers;  // files of each role so far
  for (std::size_t g = 0; g < config.groups.size(); ++g) {
    const DriveGroup& group = config.groups[g];
    if (!request.quiet)
      std::fprintf(stderr, "record %zu of %zu (%s, %g s)\n", g + 1, config.groups.size(), group.role.c_str(),
                   group.duration_s);
    const GroupDrive drive = make_group_drive(config, g, lead);
    const GeneratedRecord clean = generate_record(
        unquantised(config.plant), drive.values, config.sampling_hz,
        {.substeps = config.substeps, .lead_samples = lead, .from_equilibrium = config.from_equilibrium});
    if (clean.status != Status::ok) {
      provenance["status"] = std::string(to_string(clean.status));
      provenance["message"] = fmt::format("record {}: {}", g + 1, clean.message);
      write_json(request.out / "provenance.json", provenance);
      std::fprintf(stderr, "record %zu: %s\n", g + 1, clean.message.c_str());
      return 1;
    }
    for (Index r = 0; r < group.repeats; ++r) {
      Record record;
      record.file = fmt::format("{}_{}.csv", group.role, ++numbers[group.role]);
      record.role = group.role;
      if (group.repeats > 1) record.repeat_of = fmt::format("drive_{}", g + 1);
      record.signal = clean.signal;
      Vector noise_std = Vector::Zero(config.plant.sensor_count());
      if (config.noise_snr_db) {
        Random random(static_cast<std::uint64_t>(config.seed), Stream::noise, set.records.size(),
                      static_cast<std::uint64_t>(config.realisation));
        noise_std = add_noise(record.signal, *config.noise_snr_db, random);
      }
      quantise(config.plant, record.signal.y);
      noise_power += noise_std.cwiseAbs2();
      Json levels = Json::object();
      for (Index i = 0; i < noise_std.size(); ++i)
        levels[config.plant.sensors[static_cast<std::size_t>(i)].name] = noise_std(i);
      provenance["records"].push_back(
          {{"file", record.file}, {"group", g}, {"noise_std", std::move(levels)}, {"lines", drive.lines}});
      set.records.push_back(std::move(record));
    }
  }
  if (config.noise_snr_db)
    for (Index i = 0; i < noise_power.size(); ++i)
      set.noise_std[config.plant.sensors[static_cast<std::size_t>(i)].name] =
          std::sqrt(noise_power(i) / static_cast<double>(set.records.size()));
  write_json(request.out / "plant.json", to_json(config.plant));
  write_json(request.out / "provenance.json", provenance);
  write_records(request.out, set);
  return 0;
}

}  // namespace wheelhop
