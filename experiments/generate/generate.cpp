#include "experiments/generate/generate.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdio>

#include "core/base/files.hpp"
#include "core/data/noise.hpp"
#include "core/data/records.hpp"
#include "core/plant/dataset.hpp"
#include "core/plant/road.hpp"
#include "experiments/generate/config.hpp"
#include "experiments/rig/sha256.hpp"
#include "experiments/run/file_uses.hpp"

#ifndef WHEELHOP_VERSION
#define WHEELHOP_VERSION "unversioned"
#endif

namespace wheelhop {
namespace {

constexpr const char* kDatasetSchema = "wheelhop.dataset/1";

struct GroupDrive {
  Matrix values;  // m x (lead + samples * ratio)
  Json lines;     // of the multisines, by input
};

GroupDrive make_group_drive(const GenerateConfig& config, std::size_t group_index, Index lead) {
  const DriveGroup& group = config.groups[group_index];
  const double hold_hz = config.plant.hold_hz();
  const Index samples = std::llround(group.options.duration_s * config.options.sampling_hz) *
                        hold_samples_per_record_sample(config.plant, config.options.sampling_hz);
  GroupDrive result{Matrix::Zero(config.plant.input_count(), lead + samples), Json::object()};
  for (const auto& [input, options] : group.drives) {
    // Cells keep the drives apart; 4096 inputs are more than any plant has.
    Random random(static_cast<std::uint64_t>(config.options.seed), Stream::road,
                  group_index * 4096 + static_cast<std::size_t>(input),
                  static_cast<std::uint64_t>(config.options.realisation));
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

/// What tells this set from every other one: a check sum of its config and its numbers.
std::string identity_of(const Json& config, const RecordSet& set) {
  std::string bytes = config.dump();
  for (const Record& record : set.records)
    for (const Matrix* values : {&record.signal.u, &record.signal.y})
      bytes.append(reinterpret_cast<const char*>(values->data()), static_cast<std::size_t>(values->size()) * 8);
  return blind::sha256(bytes).substr(0, 16);
}

/// Names of the records that an earlier call left in a folder.
std::vector<std::string> earlier_records(const std::filesystem::path& folder) {
  std::vector<std::string> names;
  std::error_code ignored;
  const std::filesystem::path file = folder / "provenance.json";
  if (!std::filesystem::is_regular_file(file, ignored)) return names;
  const Json earlier = Json::parse(read_file(file), nullptr, false);
  if (!earlier.is_object() || earlier.value("schema", Json()) != kDatasetSchema || !earlier.contains("records"))
    return names;
  for (const Json& record : earlier["records"]) {
    const std::string name = record.is_object() && record.contains("file") && record["file"].is_string()
                                 ? record["file"].get<std::string>()
                                 : "";
    if (!name.empty() && std::filesystem::path(name).filename() == name) names.push_back(name);
  }
  return names;
}

}  // namespace

int run_generate(const GenerateRequest& request) {
  FileUses()
      .reads_named("CONFIG", request.config)
      .writes_folder("--out", request.out, {"plant.json", "provenance.json", "records.json"})
      .check();
  const JsonCursor cursor = JsonCursor::load(request.config);
  const GenerateConfig config = read_generate_config(cursor);
  const Index lead = std::llround(config.options.settle_s * config.plant.hold_hz());
  RecordSet set;
  set.sampling_hz = config.options.sampling_hz;
  Json provenance = {{"schema", kDatasetSchema}, {"version", WHEELHOP_VERSION}, {"status", "ok"}, {"message", ""}};
  provenance["config"] = effective_config(config);
  provenance["records"] = Json::array();
  Vector noise_power = Vector::Zero(config.plant.sensor_count());
  std::map<std::string, int> numbers;  // files of each role so far
  for (std::size_t g = 0; g < config.groups.size(); ++g) {
    const DriveGroup& group = config.groups[g];
    if (!request.quiet)
      std::fprintf(stderr, "record %zu of %zu (%s, %g s)\n", g + 1, config.groups.size(), group.options.role.c_str(),
                   group.options.duration_s);
    const GroupDrive drive = make_group_drive(config, g, lead);
    const GeneratedRecord clean = generate_record(unconverted(config.plant), drive.values, config.options.sampling_hz,
                                                  {.substeps = config.options.substeps,
                                                   .lead_samples = lead,
                                                   .from_equilibrium = config.options.start == "equilibrium"});
    if (clean.status != Status::ok) {
      provenance["status"] = std::string(to_string(clean.status));
      provenance["message"] = fmt::format("record {}: {}", g + 1, clean.message);
      const bool holds_set = std::filesystem::exists(request.out / "records.json");
      if (!holds_set) {
        require_writable_folder(request.out);
        write_json(request.out / "provenance.json", provenance);
      }
      std::fprintf(stderr, "record %zu: %s%s\n", g + 1, clean.message.c_str(),
                   holds_set ? "; the set that stands in the folder is left as it is" : "");
      return 1;
    }
    for (Index r = 0; r < group.options.repeats; ++r) {
      Record record;
      record.file = fmt::format("{}_{}.csv", group.options.role, ++numbers[group.options.role]);
      record.role = group.options.role;
      if (group.options.repeats > 1) record.repeat_of = fmt::format("drive_{}", g + 1);
      record.signal = clean.signal;
      Vector noise_std = Vector::Zero(config.plant.sensor_count());
      if (config.options.noise_snr_db) {
        Random random(static_cast<std::uint64_t>(config.options.seed), Stream::noise, set.records.size(),
                      static_cast<std::uint64_t>(config.options.realisation));
        noise_std = add_noise(record.signal, *config.options.noise_snr_db, random);
      }
      convert_readings(config.plant, record.signal.y);
      noise_power += noise_std.cwiseAbs2();
      Json levels = Json::object();
      for (Index i = 0; i < noise_std.size(); ++i)
        levels[config.plant.sensors[static_cast<std::size_t>(i)].name] = noise_std(i);
      provenance["records"].push_back(
          {{"file", record.file}, {"group", g}, {"noise_std", std::move(levels)}, {"lines", drive.lines}});
      set.records.push_back(std::move(record));
    }
  }
  if (config.options.noise_snr_db)
    for (Index i = 0; i < noise_power.size(); ++i)
      set.noise_std[config.plant.sensors[static_cast<std::size_t>(i)].name] =
          std::sqrt(noise_power(i) / static_cast<double>(set.records.size()));
  set.identity = identity_of(provenance["config"], set);
  provenance["set"] = set.identity;
  StagedSet staged(request.out, "records.json");
  write_json(staged.path() / "plant.json", to_json(config.plant));
  write_json(staged.path() / "provenance.json", provenance);
  write_records(staged.path(), set);
  staged.publish(earlier_records(request.out), "provenance.json");
  return 0;
}

}  // namespace wheelhop
