#include "experiments/generate/config.hpp"

#include <fmt/format.h>

#include <cmath>

#include "core/base/status.hpp"
#include "core/plant/dataset.hpp"
#include "experiments/run/input_checks.hpp"

namespace wheelhop {
namespace {

Plant read_plant(const JsonCursor& cursor) {
  if (!cursor.is_string()) return require_acting_inputs(parse_plant(cursor), cursor.where());
  return load_acting_plant(cursor.directory() / cursor.string());
}

DriveGroup read_group(const JsonCursor& cursor, const GenerateConfig& config) {
  for (const char* required : {"role", "duration_s"}) cursor.at(required);
  DriveGroup group{read_options<GroupOptions>(cursor), {}};
  const double sampling_hz = config.options.sampling_hz, samples = group.options.duration_s * sampling_hz;
  if (samples < 2 || std::abs(samples - std::round(samples)) > 1e-6)
    cursor.at("duration_s").fail(fmt::format("a duration of at least two whole samples of 1/{} s", sampling_hz));
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

}  // namespace

GenerateConfig read_generate_config(const JsonCursor& cursor) {
  GenerateConfig config;
  config.plant = read_plant(cursor.at("plant"));
  config.options = read_options<GenerateOptions>(cursor);
  if (auto member = cursor.find("hold_hz"))
    for (PlantInput& input : config.plant.inputs) input.hold_hz = member->number({.low = 1e-3, .high = 1e7});
  try {
    hold_samples_per_record_sample(config.plant, config.options.sampling_hz);
  } catch (const UserError& error) {
    throw UserError(cursor.where() + ".sampling_hz: " + error.what());
  }
  if (config.options.substeps == 0) config.options.substeps = stable_substeps(config.plant);
  const JsonCursor records = cursor.at("records");
  for (const JsonCursor& item : records.items()) config.groups.push_back(read_group(item, config));
  if (config.groups.empty()) records.fail("at least one record");
  cursor.done();
  return config;
}

Json effective_config(const GenerateConfig& config) {
  Json out = {{"plant", to_json(config.plant)}, {"hold_hz", config.plant.hold_hz()}};
  out.update(write_options(config.options));
  out["records"] = Json::array();
  for (const DriveGroup& group : config.groups) {
    Json drives = Json::object();
    for (const auto& [input, options] : group.drives)
      drives[config.plant.inputs[static_cast<std::size_t>(input)].name] = to_json(options);
    Json item = write_options(group.options);
    item["drive"] = std::move(drives);
    out["records"].push_back(std::move(item));
  }
  return out;
}

}  // namespace wheelhop
